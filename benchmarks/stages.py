"""Time each stage of the pipeline on a mesh: python benchmarks/stages.py MESH [-k N] [--repeat N].

Prints the median over the runs; the built-in scene is used where no mesh is named.
"""

from __future__ import annotations

import argparse
import statistics
import time

import o3d_relief as rel


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("mesh", nargs="?", help="a mesh file (default: the built-in scene)")
    parser.add_argument("-k", type=int, default=128)
    parser.add_argument("--repeat", type=int, default=5)
    options = parser.parse_args()

    mesh = rel.read_mesh(options.mesh) if options.mesh else rel.demo_scene()
    params = rel.ReliefParams(k=options.k)
    rel.make_relief(mesh, params)  # the first call loads libraries
    runs, totals = [], []
    for _ in range(options.repeat):
        started = time.perf_counter()
        runs.append(rel.make_relief(mesh, params).stages)
        totals.append(time.perf_counter() - started)
    print(
        f"{options.mesh or 'built-in scene'}: {len(mesh.vertices)} vertices, {len(mesh.triangles)} triangles"
    )
    for name in runs[0]:
        print(f"{name:<13}{statistics.median(run[name].seconds for run in runs):8.3f} s")
    print(
        f"{'total':<13}{statistics.median(totals):8.3f} s  (worst of {options.repeat}: {max(totals):.3f} s)"
    )


if __name__ == "__main__":
    main()
