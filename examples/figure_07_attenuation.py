"""The attenuation function (figure 7, Eq. 3): python examples/figure_07_attenuation.py [MESH [OUTPUT]].

What becomes of the differentials of a scene's attenuation points, for several attenuation factors. Needs
matplotlib.
"""

import sys

import numpy as np

import o3d_relief as rel
from o3d_relief.files import check_place


def main(scene: str | None = None, output: str = "figure_07.png", *, panel: int = 460) -> None:
    check_place(output)
    try:
        import matplotlib as mpl
    except ImportError:
        raise rel.ReliefError("This figure needs matplotlib: pip install matplotlib.") from None
    mpl.use("Agg")
    import matplotlib.pyplot as plt

    mesh = rel.read_mesh(scene) if scene else rel.demo_scene()
    points = rel.make_relief(mesh, rel.ReliefParams.paper(k=128)).stages["attenuation"]
    scaled = np.abs(points.differential[points.action == "scale"])
    reach = 1.3 * float(scaled.max(initial=20.0))
    figure, axis = plt.subplots(figsize=(7, 5), layout="constrained")
    step = np.linspace(0.0, reach, 400)
    axis.plot(step, step, "--", color="grey", label="unchanged")
    for beta in (0.02, 0.05, 0.1, 0.2, 0.5, 1.0):
        (line,) = axis.plot(step, np.arctan(beta * step) / beta, label=f"β = {beta:g}")
        axis.plot(scaled, np.arctan(beta * scaled) / beta, "o", markersize=4, color=line.get_color())
    axis.set(
        xlim=(0, reach), ylim=(0, 0.6 * reach), xlabel="differential before", ylabel="after, arctan(β Δ) / β"
    )
    axis.set_title(f"{len(scaled)} attenuation points that are scaled, in relief units")
    axis.legend()
    figure.savefig(output, dpi=panel / 4.6)
    plt.close(figure)
    print(f"{output}: differentials up to {scaled.max(initial=0.0):.1f}")


if __name__ == "__main__":
    from start import start

    start(main, __doc__, sys.argv[1:])
