"""Depth order errors and their restoration (figure 9).

python examples/figure_09_restoration.py [MESH [OUTPUT]]
"""

import sys

import numpy as np
import open3d as o3d

import o3d_relief as rel


def main(scene: str | None = None, output: str = "figure_09.png", *, panel: int = 460, k: int = 256) -> None:
    mesh = rel.read_mesh(scene) if scene else rel.demo_scene()
    stages = rel.make_relief(mesh, rel.ReliefParams.paper(k=k)).stages
    smooth = rel.make_relief(mesh, rel.ReliefParams.paper(k=k, smooth_points=True)).stages
    places, faces = stages["scene"].vertices, stages["scene"].faces

    def surface(z: np.ndarray) -> o3d.geometry.TriangleMesh:
        return o3d.geometry.TriangleMesh(
            o3d.utility.Vector3dVector(np.column_stack([places[:, :2], z])),
            o3d.utility.Vector3iVector(faces.astype(np.int32)),
        )

    before = stages["construction"].z
    after = {
        "constructed": before,
        "restored as in the paper": stages["restoration"].z,
        "and around each point": smooth["restoration"].z,
    }
    error, size = stages["restoration"].order_error, (panel, panel)
    shown = {"field": error, "field_range": (0.0, 1.0), "colormap": "heat", "field_label": "error"}
    pictures = [rel.render(surface(before), size=size, title="depth order errors", **shown)]
    # Close up, at the attenuation point that had moved furthest away from its surroundings.
    points = stages["attenuation"].kept_index
    spike = points[np.argmax(np.abs(smooth["restoration"].z - before)[points])]
    middle = np.array([*places[spike, :2], before[spike]])
    box = np.array([middle - 8.0, middle + 8.0])
    for title, z in after.items():
        view = rel.view_direction(15, 10)
        pictures.append(rel.render(surface(z), direction=view, bounds=box, title=title, size=size))
    rel.save_png(output, rel.contact_sheet(pictures, 4))
    counts = stages["restoration"].counts
    print(
        f"{output}: {counts['high_errors']} of {len(places)} vertices wrong, {counts['solved']} solved again"
    )


if __name__ == "__main__":
    from start import start

    start(main, __doc__, sys.argv[1:])
