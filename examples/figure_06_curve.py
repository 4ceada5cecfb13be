"""Clusters and attenuation points in 2D (figure 6): python examples/figure_06_curve.py [MESH [OUTPUT]].

The whole method on a curve, which is a narrow strip here: x across, the distance to the relief plane
upwards. Of a mesh, the slice at half its height is drawn. Needs matplotlib.
"""

import sys

import numpy as np
import open3d as o3d

import o3d_relief as rel
from o3d_relief.files import check_place

ACTIONS = {"attach": "tab:blue", "scale": "tab:orange", "discard": "tab:red"}


def folded_strip(steps: int = 301) -> o3d.geometry.TriangleMesh:
    """Make a curve with overhangs, as a strip one unit wide."""
    t = np.linspace(0.0, 1.0, steps)
    wave = 8.0 * np.pi * t
    x = 100.0 * t + 5.0 * np.sin(2.0 * wave)  # heads wider than their necks
    z = 22.0 - (11.0 + 4.0 * np.cos(7.0 * t)) * np.cos(wave) + 8.0 * np.sin(3.0 * np.pi * t)
    vertices = np.concatenate([np.column_stack([x, np.full(steps, y), z]) for y in (-0.5, 0.5)])
    a = np.arange(steps - 1)
    faces = np.concatenate(
        [np.column_stack([a, a + 1, a + 1 + steps]), np.column_stack([a, a + 1 + steps, a + steps])]
    )
    return o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector(vertices), o3d.utility.Vector3iVector(faces.astype(np.int32))
    )


def main(scene: str | None = None, output: str = "figure_06.png", *, panel: int = 460) -> None:
    check_place(output)
    try:
        import matplotlib as mpl
    except ImportError:
        raise rel.ReliefError("This figure needs matplotlib: pip install matplotlib.") from None
    mpl.use("Agg")
    import matplotlib.pyplot as plt

    mesh = rel.read_mesh(scene) if scene else folded_strip()
    k = 64 if scene else 14
    relief = rel.make_relief(mesh, rel.ReliefParams.paper(k=k))
    flat = rel.make_relief(mesh, rel.ReliefParams.paper(k=k, attach_below=1, discard_above=1, beta=1e6))
    before, points, z = relief.stages["scene"].vertices, relief.stages["attenuation"], {}
    z["original"], z["every point attached"] = before[:, 2], flat.stages["construction"].z
    z["points moved by their differentials"] = relief.stages["construction"].z
    near = np.abs(before[:, 1]) < (1.0 if scene else np.inf)
    mine = near[points.index]
    x, color = before[:, 0], mpl.colormaps["tab20"](relief.stages["clusters"].labels % 20)
    edge = np.where(
        relief.stages["visibility"].visible[:, None], (0.1, 0.1, 0.1, 1.0), (0.75, 0.75, 0.75, 1.0)
    )

    figure, axes = plt.subplots(2, 2, figsize=(12, 6), sharex=True, sharey=True, layout="constrained")
    heights = [
        z["original"],
        z["every point attached"],
        z["original"],
        z["points moved by their differentials"],
    ]
    titles = ["clusters (colour) and what is visible (dark rim)", "every attenuation point attached"]
    titles += ["differentials of the attenuation points", "points moved by their differentials"]
    for number, (axis, height, title) in enumerate(zip(axes.flat, heights, titles, strict=True)):
        faint = 0.25 if number == 2 else 1.0
        axis.scatter(
            x[near], height[near], 16, color[near], edgecolors=edge[near], linewidths=0.7, alpha=faint
        )
        axis.axhline(0.0, color="black", linewidth=1.5)
        axis.set_title(title)
        axis.set_aspect("equal")
    place = x[points.index[mine]]
    axes[0, 0].scatter(place, points.height[mine], 70, "none", edgecolors="black", linewidths=1.8)
    for action, shade in ACTIONS.items():
        of = mine & (points.action == action)
        # The bar reaches from the mean height of the neighbours to the point: its length is Eq. 1.
        low = (points.height - points.differential)[of]
        axes[1, 0].vlines(x[points.index[of]], low, points.height[of], shade, linewidth=3, label=action)
        axes[1, 0].plot(x[points.index[of]], points.height[of], "o", color=shade)
    axes[1, 0].legend(loc="upper center", fontsize="small")
    figure.savefig(output, dpi=panel / 4.6)
    plt.close(figure)
    print(f"{output}: {dict(relief.stages['attenuation'].counts)}")


if __name__ == "__main__":
    from start import start

    start(main, __doc__, sys.argv[1:])
