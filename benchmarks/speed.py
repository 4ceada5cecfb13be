"""How fast is it: python benchmarks/speed.py MESH... [--sizes N...] [--repeat N] [-k N] [--profile].

Runs in one process, in turn: (a) the package, with the paper's parameters, with its defaults, and in bounded
mode to a quarter of the scene's visible depth; (b) a straightforward transcription of the paper,
`literal.py`; (c) the floor: one visibility pass plus one factorisation and solution of the construction's
matrix with the fastest direct solver at hand (pypardiso or cholespy, in the extra "bench"). Ratios are taken
within each round, medians over the rounds. Processor time counts all threads; it tells more than the clock
where others share the machine. Memory is the peak above what the process has with its libraries loaded, the
mesh included. --profile tells which functions of the package the time goes into.
"""

from __future__ import annotations

import argparse
import cProfile
import ctypes
import gc
import os
import platform
import pstats
import statistics
import sys
import threading
import time
from collections.abc import Callable
from concurrent.futures import Executor, Future
from dataclasses import dataclass, field
from functools import partial
from importlib import import_module, metadata
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
import open3d as o3d
import psutil
import scipy.sparse as sp

import o3d_relief as rel
from literal import literal_relief
from o3d_relief.stages.visibility import visible_vertices
from refined import refined

WATCH_EVERY = 0.01
"""Seconds between two looks at the memory."""

PROFILE_FROM = 0.02
"""Share of the time from which on a function is listed in a profile."""


@dataclass
class Cost:
    """What one run took: seconds by the clock and of the processor, GB of memory, seconds of each stage."""

    wall: float
    cpu: float
    memory: float
    stages: dict[str, float] = field(default_factory=dict)


class _Watch:
    """The peak of the process's memory while it is entered, above a base, in GB."""

    def __init__(self, base: int) -> None:
        self._base = base
        self._process = psutil.Process()
        self._stop = threading.Event()
        self._peak = 0

    def __enter__(self) -> _Watch:
        self._thread = threading.Thread(target=self._look, daemon=True)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()

    def _look(self) -> None:
        while True:
            self._peak = max(self._peak, self._process.memory_info().rss)
            if self._stop.wait(WATCH_EVERY):
                return

    @property
    def gigabytes(self) -> float:
        return (self._peak - self._base) / 1e9


def _give_back() -> None:
    """Free what is not in use, so that one run's memory does not count for the next."""
    gc.collect()
    if sys.platform == "linux":
        trim = getattr(ctypes.CDLL(None), "malloc_trim", None)  # of glibc only
        if trim is not None:
            trim(0)


def timed(work: Callable[[], dict[str, float]], base: int) -> Cost:
    """Run something that returns the seconds of its stages."""
    _give_back()
    with _Watch(base) as watch:
        wall, cpu = time.perf_counter(), time.process_time()
        stages = work()
        cost = Cost(time.perf_counter() - wall, time.process_time() - cpu, 0.0, stages)
    cost.memory = watch.gigabytes
    return cost


def direct_solver() -> tuple[str, Callable[[sp.csr_array, np.ndarray], np.ndarray]]:
    """Return the name of the fastest direct solver that is installed, and a function that solves with it."""
    for name, solve in (("pypardiso", _pardiso), ("cholespy", _cholmod)):
        try:
            module = import_module(name)
        except ImportError:
            continue
        return f"{name} {metadata.version(name)}", lambda a, b, solve=solve, module=module: solve(
            module, a, b
        )
    raise SystemExit("speed.py: the floor needs pypardiso or cholespy: pip install 'o3d-relief[bench]'.")


def _pardiso(module: Any, matrix: sp.csr_array, right: np.ndarray) -> np.ndarray:
    solver = module.PyPardisoSolver(mtype=2)  # symmetric positive definite
    solution = solver.solve(sp.csr_matrix(sp.triu(matrix, format="csr")), right)
    solver.free_memory(everything=True)
    return np.asarray(solution)


def _cholmod(module: Any, matrix: sp.csr_array, right: np.ndarray) -> np.ndarray:
    entries = matrix.tocoo()
    rows, columns = entries.row.astype(np.int32), entries.col.astype(np.int32)
    solver = module.CholeskySolverD(matrix.shape[0], rows, columns, entries.data, module.MatrixType.COO)
    solution = np.zeros_like(right)
    solver.solve(right, solution)
    return solution


class Case:
    """One mesh and what is run on it."""

    def __init__(self, mesh: o3d.geometry.TriangleMesh, k: int, base: int) -> None:
        self._mesh, self._k, self._base = mesh, k, base
        stages: dict[str, Any] = dict(rel.make_relief(mesh, rel.ReliefParams.paper(k=k)).stages)
        self._vertices, self._faces = stages["scene"].vertices, stages["scene"].faces
        self._fixed = stages["attenuation"].kept_index
        self.vertices = len(self._vertices)
        depth = float(np.ptp(self._vertices[stages["visibility"].visible, 2])) * stages["scene"].unit
        self.quarter = rel.ReliefParams(depth=depth / 4.0)

    def package(self, params: rel.ReliefParams) -> Cost:
        """Run the package."""

        def work() -> dict[str, float]:
            relief = rel.make_relief(self._mesh, params)
            return {name: record.seconds for name, record in relief.stages.items()}

        return timed(work, self._base)

    def runs(self, k: int, *, full: bool) -> dict[str, rel.ReliefParams]:
        """Return what of the package is measured."""
        runs = {"package": rel.ReliefParams.paper(k=k)}
        return runs | {"defaults": rel.ReliefParams(k=k), "bounded": self.quarter} if full else runs

    def literal(self) -> Cost:
        """Run the transcription, on the scene that the package has welded and scaled."""
        return timed(lambda: literal_relief(self._vertices, self._faces, self._k)[2], self._base)

    def floor(self, solve: Callable[[sp.csr_array, np.ndarray], np.ndarray]) -> Cost:
        """Run the floor, on the matrix of the package's construction."""
        laplacian, _ = rel.cotangent_laplacian(self._vertices, self._faces)
        free = np.ones(len(self._vertices), dtype=bool)
        free[self._fixed] = False
        rows = laplacian[np.flatnonzero(free)]
        matrix = rows[:, np.flatnonzero(free)].tocsr()
        right = rows[:, self._fixed] @ self._vertices[self._fixed, 2]

        def work() -> dict[str, float]:
            started = time.perf_counter()
            visible_vertices(self._vertices, self._faces)
            seen = time.perf_counter()
            solve(matrix, right)
            return {"visibility": seen - started, "construction": time.perf_counter() - seen}

        return timed(work, self._base)


class _AtOnce(Executor):
    """Does what it is asked for in the thread that asks: of several, a profiler sees one or mixes all up."""

    def __init__(self, *_: object, **__: object) -> None: ...

    def submit(self, function: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Do it, and return the result as one that is there already; an error is raised right here."""
        done: Future[Any] = Future()
        done.set_result(function(*args, **kwargs))
        return done


def profile(work: Callable[[], object]) -> list[str]:
    """Return a table of the package's functions that take the most time, by the processor's clock.

    All of it runs in one thread. Python 3.13 leaves out the outermost functions: its profiler loses them.
    """
    profiler = cProfile.Profile(time.process_time)
    with mock.patch("o3d_relief.threads.ThreadPoolExecutor", _AtOnce):
        profiler.runcall(work)
    stats: Any = pstats.Stats(profiler)
    package = Path(rel.__file__).parent
    found = [
        (whole, own, calls, f"{Path(file).relative_to(package).with_suffix('').as_posix()}.{name}")
        for (file, _, name), (_, calls, own, whole, _) in stats.stats.items()
        if package in Path(file).parents and whole >= PROFILE_FROM * stats.total_tt
    ]
    lines = ["| function | calls | CPU s | without what it calls |", "|---|---|---|---|"]
    lines += [
        f"| {name} | {calls} | {whole:.2f} | {own:.2f} |"
        for whole, own, calls, name in sorted(found, reverse=True)
    ]
    return lines


def measure(
    case: Case,
    solve: Callable[[sp.csr_array, np.ndarray], np.ndarray] | None,
    *,
    repeat: int,
    k: int,
    literal: bool,
    full: bool,
) -> dict[str, list[Cost]]:
    """Run everything in turn, `repeat` times."""
    costs: dict[str, list[Cost]] = {}
    for _ in range(repeat):
        for number, (what, params) in enumerate(case.runs(k, full=full).items()):
            costs.setdefault(what, []).append(case.package(params))
            if number == 0 and solve is not None:
                costs.setdefault("floor", []).append(case.floor(solve))
        if literal:
            costs.setdefault("literal", []).append(case.literal())
    return costs


def median(costs: list[Cost], pick: Callable[[Cost], float]) -> float:
    return statistics.median(pick(cost) for cost in costs)


def ratio(over: list[Cost], under: list[Cost], pick: Callable[[Cost], float]) -> float:
    """Return the median of the ratios within each round."""
    return statistics.median(pick(one) / pick(other) for one, other in zip(over, under, strict=True))


def rows_of(name: str, vertices: int, costs: dict[str, list[Cost]]) -> list[str]:
    """Return a row of the table for each of what was run."""
    rows = []
    for what, runs in costs.items():
        memory = median(runs, lambda cost: cost.memory)
        cells = [
            name,
            f"{vertices:,}",
            what,
            f"{median(runs, lambda cost: cost.wall):.3g}",
            f"{median(runs, lambda cost: cost.cpu):.3g}",
        ]
        for pick in (lambda cost: cost.wall, lambda cost: cost.cpu):
            cells.append(f"{ratio(runs, costs['floor'], pick):.2f}" if "floor" in costs else "–")
        cells += [f"{memory:.2f}", f"{memory / vertices * 1e6:.2f}"]
        rows.append("| " + " | ".join(cells) + " |")
    return rows


def stage_table(costs: dict[str, list[Cost]]) -> list[str]:
    """Return a table of the seconds of each stage, by the clock."""
    names = list(dict.fromkeys(stage for runs in costs.values() for run in runs for stage in run.stages))
    lines = ["| stage | " + " | ".join(costs) + " |", "|---|" + "---|" * len(costs)]
    for stage in names:
        cells = [
            f"{statistics.median(run.stages[stage] for run in runs):.3g}" if stage in runs[0].stages else "–"
            for runs in costs.values()
        ]
        lines.append(f"| {stage} | " + " | ".join(cells) + " |")
    return lines


def machine(solver: str) -> str:
    """Describe the machine and the libraries."""
    processor = platform.processor() or platform.machine()
    known = Path("/proc/cpuinfo")
    if known.exists():
        named = [
            line.split(":", 1)[1].strip() for line in known.read_text().splitlines() if "model name" in line
        ]
        processor = named[0] if named else processor
    libraries = ", ".join(
        f"{name} {metadata.version(name)}" for name in ("numpy", "scipy", "open3d", "pyamg")
    )
    load = f", load {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else ""
    return (
        f"{processor}, {os.cpu_count()} cores{load}, {psutil.virtual_memory().total / 1e9:.0f} GB, "
        f"{platform.system()}, Python {platform.python_version()}, {libraries}, floor: {solver}"
    )


HEAD = [
    "| mesh | vertices | what | s | CPU s | of the floor | of its CPU s | GB | GB per million vertices |",
    "|---|---|---|---|---|---|---|---|---|",
]


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("mesh", nargs="+", help="mesh files")
    parser.add_argument("--sizes", type=float, nargs="*", default=[], help="also refined to so many vertices")
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("-k", type=int, default=128)
    parser.add_argument("--literal-up-to", type=float, default=3e5, help="vertices up to which (b) is run")
    parser.add_argument("--floor-up-to", type=float, default=2e6, help="vertices up to which (c) is run")
    parser.add_argument("--profile", action="store_true", help="run once more, and list the functions")
    parser.add_argument("--no-defaults", action="store_true", help="leave out defaults and bounded mode")
    options = parser.parse_args()
    solver, solve = direct_solver()
    ball = o3d.geometry.TriangleMesh.create_sphere()
    rel.make_relief(ball, rel.ReliefParams(k=4))  # the first call loads libraries
    gc.collect()
    base = psutil.Process().memory_info().rss
    print(machine(solver), flush=True)
    table = list(HEAD)
    for path in map(Path, options.mesh):
        for size in [None, *options.sizes]:
            mesh = rel.read_mesh(path)
            name = path.stem if size is None else f"{path.stem}, refined"
            case = Case(mesh if size is None else refined(mesh, int(size)), options.k, base)
            costs = measure(
                case,
                solve if case.vertices <= options.floor_up_to else None,
                repeat=options.repeat,
                k=options.k,
                literal=case.vertices <= options.literal_up_to,
                full=not options.no_defaults,
            )
            print(f"\n{name}, {case.vertices:,} vertices, seconds of each stage\n")
            print("\n".join(stage_table(costs)), flush=True)
            table += rows_of(name, case.vertices, costs)
            runs = case.runs(options.k, full=not options.no_defaults) if options.profile else {}
            for what, params in runs.items():
                print(f"\n{name}, {case.vertices:,} vertices, {what}\n")
                print("\n".join(profile(partial(case.package, params))), flush=True)
    print("\n" + "\n".join(table))


if __name__ == "__main__":
    main()
