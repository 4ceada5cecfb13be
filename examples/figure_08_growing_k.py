"""More attenuation points, less depth (figure 8): python examples/figure_08_growing_k.py [MESH [OUTPUT]]."""

import sys

import numpy as np

import o3d_relief as rel


def main(scene: str | None = None, output: str = "figure_08.png", *, panel: int = 400) -> None:
    mesh = rel.read_mesh(scene) if scene else rel.demo_scene()
    meshes = {}
    for k in (1, 16, 64, 128):
        relief = rel.make_relief(mesh, rel.ReliefParams(k=k))
        summary = relief.summary()
        title = f"k = {k}, depth {summary['relief_depth'] / summary['unit']:.0f}"
        meshes[title] = relief.mesh
        print(title)
    placed = mesh.transform(np.linalg.inv(relief.to_scene))
    sheet = rel.comparison_sheet({"scene": placed} | meshes, (0, 50), plates=meshes, panel=(panel, panel))
    rel.save_png(output, sheet)


if __name__ == "__main__":
    from start import start

    start(main, __doc__, sys.argv[1:])
