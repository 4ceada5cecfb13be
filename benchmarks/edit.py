"""Time the editor: python benchmarks/edit.py MESH [--sizes N ...] [-k N] [--repeat N] [--front F] [--up U].

For each size, of a mesh that is decimated or refined to it, one table row: the solve of the construction as
the pipeline does it, the responses that the editor computes instead, once (their ratio is the median over
pairs), and what a change costs from then on. All are seconds of processor time; everything runs on one
thread, so that on a quiet machine they are what one waits.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable

import open3d as o3d

import o3d_relief as rel
from o3d_relief.live_construction import LiveConstruction
from o3d_relief.live_scene import LivePoints, LiveScene
from o3d_relief.stages.construction import construct
from refined import refined

SIZES = (35_000, 134_000, 250_000, 1_000_000)
CHANGES = ("alpha", "beta", "t1", "t2", "edit", "brush", "undo")


def seconds(work: Callable[[], object]) -> float:
    """Return the processor time of some work."""
    started = time.process_time()
    work()
    return time.process_time() - started


def responses_and_solve(
    mesh: o3d.geometry.TriangleMesh, params: rel.ReliefParams, view: rel.View, repeat: int
) -> tuple[float, float, float]:
    """Time the responses and one solve of the construction: medians, and the median of their ratios."""
    scene = LiveScene(mesh, params, view)
    points, _ = LivePoints(scene, params).preview(params)
    springs = scene.springs if params.in_order else None
    found = []
    for _ in range(repeat):
        one = seconds(
            lambda: construct(scene.vertices, scene.laplacian, points.kept_index, points.kept_height)
        )
        both = seconds(lambda: LiveConstruction(scene.vertices, scene.laplacian, points.index, springs))
        found.append((one, both, both / one))
    one, both, ratio = (statistics.median(column) for column in zip(*found, strict=True))
    return one, both, ratio


def changes(editor: rel.ReliefEditor, repeat: int) -> dict[str, float]:
    """Time one change of each kind; medians."""
    many = list(range(0, len(editor.points.beta), 9))
    found: dict[str, list[float]] = {name: [] for name in CHANGES}
    for i in range(repeat):
        share = i / repeat
        works: dict[str, Callable[[], object]] = {
            "alpha": lambda share=share: editor.change(alpha=0.5 + 0.4 * share),
            "beta": lambda share=share: editor.change(beta=0.05 + 0.3 * share),
            "t1": lambda share=share: editor.change(discard_above=0.5 + 0.3 * share),
            "t2": lambda share=share: editor.change(attach_below=0.1 + 0.3 * share),
            "edit": lambda i=i: editor.edit(i, action="discard"),
            "brush": lambda share=share: editor.edit(many, action="attach", beta=0.1 + share),
            "undo": editor.undo,
        }
        for name in CHANGES:
            found[name].append(seconds(works[name]))
    return {name: statistics.median(times) for name, times in found.items()}


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__)
    add = parser.add_argument
    add("mesh", help="a mesh file")
    add("--sizes", type=int, nargs="+", default=SIZES, metavar="N", help="numbers of vertices")
    add("-k", type=int, default=128)
    add("--repeat", type=int, default=5)
    add("--front", default="z")
    add("--up", default="y")
    options = parser.parse_args()

    mesh = rel.read_mesh(options.mesh)
    view, params = rel.View(front=options.front, up=options.up), rel.ReliefParams(k=options.k)
    print(f"{options.mesh}, k = {options.k}, seconds of processor time")
    print("| vertices | solve | responses | ratio | editor | " + " | ".join(CHANGES) + " |")
    print("|---" * (5 + len(CHANGES)) + "|")
    for size in options.sizes:
        scene = refined(mesh, size)
        pairs = responses_and_solve(scene, params, view, options.repeat)
        started = time.process_time()
        editor = rel.ReliefEditor(scene, params, view=view)
        begin = time.process_time() - started
        times = changes(editor, options.repeat)
        one, both, ratio = pairs
        cells = [f"{one:.2f}", f"{both:.2f}", f"{ratio:.1f}", f"{begin:.1f}"]
        cells += [f"{times[name]:.3f}" for name in CHANGES]
        print(f"| {len(editor.heights)} | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
