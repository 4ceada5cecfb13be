"""Bas-relief against high relief, from several sides in one light (figure 12).

python examples/figure_12_bas_relief.py [MESH [OUTPUT]]

The bas-relief is a height field, made as in Weyrich et al. 2007 by the module of the benchmarks beside this
folder.
"""

import sys
from pathlib import Path

import numpy as np
import open3d as o3d

import o3d_relief as rel

sys.path.append(str(Path(__file__).resolve().parent.parent / "benchmarks"))

from baselines.height_field import sample
from baselines.weyrich import bas_relief


def main(scene: str | None = None, output: str = "figure_12.png", *, panel: int = 460) -> None:
    mesh = rel.read_mesh(scene) if scene else rel.demo_scene()
    relief = rel.make_relief(mesh, rel.ReliefParams(k=128, alpha=0.8))
    depth = relief.summary()["relief_depth"]
    placed = mesh.transform(np.linalg.inv(relief.to_scene))
    unit = relief.stages["scene"].unit
    places, faces = np.asarray(placed.vertices) / unit, np.asarray(placed.triangles).astype(np.int64)
    shallow = depth / unit / 3  # as bas-reliefs are
    places, faces = bas_relief(sample(places, faces, side=panel), shallow).triangulate()
    flat = o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector(places * unit), o3d.utility.Vector3iVector(faces.astype(np.int32))
    )
    meshes = {"scene": placed, "bas-relief": flat, "high relief": relief.mesh}
    for one in meshes.values():
        one.vertex_colors = o3d.utility.Vector3dVector()  # stone: the light alone tells the shape
    sheet = rel.comparison_sheet(
        meshes, (0, 30, 60), plates=["bas-relief", "high relief"], panel=(panel, panel)
    )
    rel.save_png(output, sheet)
    print(f"{output}: {shallow:.1f} and {depth / unit:.1f} deep, in relief units")


if __name__ == "__main__":
    from start import start

    start(main, __doc__, sys.argv[1:])
