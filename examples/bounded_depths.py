"""The closest reliefs of half, a quarter and a tenth of a scene's depth, from several sides.

python examples/bounded_depths.py [MESH [OUTPUT]]
"""

import sys

import numpy as np

import o3d_relief as rel


def main(scene: str | None = None, output: str = "bounded_depths.png", *, panel: int = 400) -> None:
    mesh = rel.read_mesh(scene) if scene else rel.demo_scene()
    meshes = {}
    for share in ("50%", "25%", "10%"):
        relief = rel.make_relief(mesh, rel.ReliefParams(depth=share))
        meshes[f"{share} of the depth"] = relief.mesh
        failures = relief.certificate.failures or ["certificate clean"]
        print(f"{share}: {relief.summary()['relief_depth']:.4g} deep, {' '.join(failures)}")
    placed = mesh.transform(np.linalg.inv(relief.to_scene))
    for one in (placed, *meshes.values()):
        one.vertex_colors = type(one.vertex_colors)()  # stone: the light alone tells the shape
    sheet = rel.comparison_sheet({"scene": placed} | meshes, (0, 30, 60), plates=meshes, panel=(panel, panel))
    rel.save_png(output, sheet)


if __name__ == "__main__":
    from start import start

    start(main, __doc__, sys.argv[1:])
