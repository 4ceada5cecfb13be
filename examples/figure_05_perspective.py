"""Forced perspective (figure 5): python examples/figure_05_perspective.py [MESH [OUTPUT]].

The scene, and the scene drawn towards a far and towards a near vanishing point behind the relief plane.
"""

import sys

import numpy as np
import open3d as o3d

import o3d_relief as rel


def main(scene: str | None = None, output: str = "figure_05.png", *, panel: int = 460) -> None:
    mesh = rel.read_mesh(scene) if scene else rel.demo_scene()
    points = {"scene": None, "far vanishing point": (0, 0, -250), "near vanishing point": (0, 0, -70)}
    bent = {}
    for title, point in points.items():
        params = rel.ReliefParams.paper(k=1)  # only the first stages are of interest
        stages = rel.make_relief(mesh, params, view=rel.View(vanishing_point=point)).stages
        places = stages["perspective"].vertices[stages["scene"].welded_index]
        bent[title] = o3d.geometry.TriangleMesh(mesh)  # with its colours
        bent[title].vertices = o3d.utility.Vector3dVector(np.ascontiguousarray(places))
    rel.save_png(output, rel.comparison_sheet(bent, (0, 40), panel=(panel, panel)))
    print(f"{output}: vanishing points {', '.join(str(point) for point in points.values())}")


if __name__ == "__main__":
    from start import start

    start(main, __doc__, sys.argv[1:])
