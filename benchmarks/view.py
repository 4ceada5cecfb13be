"""Time the stage viewer: python benchmarks/view.py MESH [--sizes N ...] [--repeat N] [--front F] [--up U].

For each size, of a mesh that is decimated or refined to it, seconds of processor time: a step to the next
stage until it is drawn, drawing alone (of the same geometry once more), and one picture of the movement
between scene and relief. Needs a display with OpenGL 3.3. Under Xvfb Mesa draws with the processor, on all
cores: that is most of the time, and falls away with a graphics card.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable

import o3d_relief as rel
from o3d_relief.show.display import require_display
from o3d_relief.show.viewer_window import ViewerWindow
from refined import refined

SIZES = (35_000, 134_000, 250_000)


def seconds(work: Callable[[], object]) -> float:
    """Return the processor time of some work."""
    started = time.process_time()
    work()
    return time.process_time() - started


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__)
    add = parser.add_argument
    add("mesh", help="a mesh file")
    add("--sizes", type=int, nargs="+", default=SIZES, metavar="N", help="numbers of vertices")
    add("--repeat", type=int, default=3)
    add("--front", default="z")
    add("--up", default="y")
    options = parser.parse_args()
    require_display()

    mesh, view = rel.read_mesh(options.mesh), rel.View(front=options.front, up=options.up)
    print(f"{options.mesh}, seconds of processor time")
    print("| vertices | faces | step | worst | drawing | movement |\n|---|---|---|---|---|---|")
    for size in options.sizes:
        scene = refined(mesh, size)
        window = ViewerWindow(lambda _line: None)
        rel.make_relief(scene, rel.ReliefParams(in_order=False), view=view, on_stage=window.take)
        window.step()

        steps, draws = [], []
        for key in "1NNNNNNNNN" * options.repeat:
            steps.append(seconds(lambda key=key, window=window: (window.press(key), window.step())))
            window.press("V")
            draws.append(seconds(window.step))
        window.press("M")
        moves = []
        while window.state.moving:
            moves.append(seconds(window.step))
        window.close()
        values = statistics.median(steps), max(steps), statistics.median(draws), statistics.median(moves)
        cells = [f"{value:.3f}" for value in values]
        faces = len(scene.triangles)
        print(f"| {len(scene.vertices)} | {faces} | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
