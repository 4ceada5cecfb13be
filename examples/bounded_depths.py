"""The closest reliefs of half, a quarter and a tenth of a scene's depth, from several sides.

python examples/bounded_depths.py [MESH [OUTPUT]]
"""

import sys

import numpy as np

import o3d_relief as rel


def main(scene: str | None = None, output: str = "bounded_depths.png", panel: int = 400) -> None:
    mesh = rel.read_mesh(scene) if scene else rel.demo_scene()
    # Deeper than the scene: it is left as it is, and its summary tells how deep it is.
    whole = rel.make_relief(mesh, rel.ReliefParams(mode="bounded", depth=1e12))
    deep = whole.summary()["scene_visible_depth"]
    meshes = {}
    for share in (0.5, 0.25, 0.1):
        relief = rel.make_relief(mesh, rel.ReliefParams(mode="bounded", depth=share * deep))
        meshes[f"{share:.0%} of the depth"] = relief.mesh
        failures = relief.certificate.failures or ["certificate clean"]
        print(f"{share:.0%}: {relief.summary()['relief_depth']:.4g} deep, {' '.join(failures)}")
    placed = mesh.transform(np.linalg.inv(whole.to_scene))
    for one in (placed, *meshes.values()):
        one.vertex_colors = type(one.vertex_colors)()  # stone: the light alone tells the shape
    sheet = rel.comparison_sheet({"scene": placed} | meshes, (0, 30, 60), plates=meshes, panel=(panel, panel))
    rel.save_png(output, sheet)


if __name__ == "__main__":
    main(*sys.argv[1:])
