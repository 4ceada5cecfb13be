"""Depth order errors and their restoration (figure 9).

python examples/figure_09_restoration.py [MESH [OUTPUT]]
"""

import sys

import numpy as np
import open3d as o3d

import o3d_relief as rel


def main(scene: str | None = None, output: str = "figure_09.png", panel: int = 460) -> None:
    mesh = rel.read_mesh(scene) if scene else rel.demo_scene()
    stages = rel.make_relief(mesh, rel.ReliefParams.paper(k=128)).stages
    places, faces = stages["scene"].vertices, stages["scene"].faces

    def surface(z: np.ndarray) -> o3d.geometry.TriangleMesh:
        return o3d.geometry.TriangleMesh(
            o3d.utility.Vector3dVector(np.column_stack([places[:, :2], z])),
            o3d.utility.Vector3iVector(faces.astype(np.int32)),
        )

    before, after = surface(stages["construction"].z), surface(stages["restoration"].z)
    error = stages["restoration"].order_error
    size = panel, panel
    pictures = [
        rel.render(
            before,
            field=error,
            field_range=(0.0, 1.0),
            colormap="heat",
            field_label="error",
            title="errors",
            size=size,
        )
    ]
    # Close up, where the restoration smooths most of what is seen.
    laplacian, _ = rel.cotangent_laplacian(places, faces)
    smoothed = np.abs(laplacian @ (stages["restoration"].z - stages["construction"].z))
    middle = np.asarray(before.vertices)[np.argmax(smoothed * stages["visibility"].visible)]
    box = np.array([middle - 6.0, middle + 6.0])
    for title, one in (("constructed", before), ("restored", after)):
        view = rel.view_direction(20, 10)
        pictures.append(rel.render(one, direction=view, bounds=box, title=title, size=size))
    rel.save_png(output, rel.contact_sheet(pictures, 3))
    counts = stages["restoration"].counts
    print(
        f"{output}: {counts['high_errors']} of {len(places)} vertices wrong, {counts['solved']} solved again"
    )


if __name__ == "__main__":
    main(*sys.argv[1:])
