"""Attenuation factors of single points (figure 10): python examples/figure_10_local_beta.py [MESH [OUTPUT]].

On one side of the scene the points have a small factor, red, and stand out; on the other a large one, blue.
Then the other way round.
"""

import sys

import numpy as np

import o3d_relief as rel

RED, BLUE = (0.85, 0.2, 0.15), (0.15, 0.35, 0.8)


def main(scene: str | None = None, output: str = "figure_10.png", *, panel: int = 460, k: int = 64) -> None:
    mesh = rel.read_mesh(scene) if scene else rel.demo_scene()
    editor = rel.ReliefEditor(mesh, rel.ReliefParams(k=k))
    placed = type(mesh)(mesh).transform(np.linalg.inv(editor.to_scene))
    pictures = []
    for side in (1.0, -1.0):
        near = side * editor.points.position[:, 0] > 0.0
        editor.edit(np.flatnonzero(near), beta=0.03)
        editor.edit(np.flatnonzero(~near), beta=0.8)
        points, relief = editor.points, editor.relief()
        colors = np.where(points.beta[:, None] < 0.1, RED, BLUE)
        legend = [(RED, "beta = 0.03"), (BLUE, "beta = 0.8")]
        size = panel, panel
        pictures.append(
            rel.render(
                placed,
                points=points.position,
                point_colors=colors,
                point_radius=panel / 90,
                legend=legend,
                size=size,
            )
        )
        for yaw in (-50, 50):
            pictures.append(rel.render(relief.mesh, direction=rel.view_direction(yaw), plate=True, size=size))
        depth = relief.summary()["relief_depth"] / editor.unit
        print(f"beta = 0.03 on the {'right' if side > 0 else 'left'}: depth {depth:.1f}")
    rel.save_png(output, rel.contact_sheet(pictures, 3))


if __name__ == "__main__":
    from start import start

    start(main, __doc__, sys.argv[1:])
