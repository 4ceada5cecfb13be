"""Poisson reconstruction in a process of its own, which can be called off."""

from __future__ import annotations

import pickle
import re
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import IO

import numpy as np
from numpy.typing import NDArray

from o3d_relief.errors import MeshError
from o3d_relief.progress import Tick
from o3d_relief.scan.poisson_open3d import Surface, reconstruct

__all__ = ["main", "reconstruct_apart"]

_PAUSE = 0.1  # seconds between two looks at whether the work is called off

_PROGRAM = (
    "import sys; sys.path[:] = {path!r}; "
    "from o3d_relief.scan.poisson_process import main; sys.exit(main({answer!r}))"
)
"""The process finds modules where this one does, and nothing of the same name in the working folder."""

_OUT_OF_MEMORY = (-9, 137)
_ERROR = re.compile(r"[\w.]+(Error|Exception)\b")


def reconstruct_apart(
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    depth: int,
    threads: int,
    scale: float,
    tick: Tick,
) -> Surface:
    """Do the same as `reconstruct` in a process of its own.

    Parameters
    ----------
    points, normals : (n, 3) float64
    depth, threads : int
    scale : float
        See `reconstruct`.
    tick : callable
        Called now and then; what it raises ends the process.

    Returns
    -------
    vertices : (v, 3) float64
    faces : (f, 3) int64
    density : (v,) float64

    Raises
    ------
    MeshError
        The process broke.
    """
    # Files, not pipes: a pipe that is full waits for somebody who reads.
    with tempfile.TemporaryDirectory(prefix="o3d-relief-") as folder:
        answer = Path(folder) / "surface.pickle"
        with (Path(folder) / "points.pickle").open("w+b") as question:
            pickle.dump((points, normals, depth, threads, scale), question, pickle.HIGHEST_PROTOCOL)
            question.seek(0)
            with (Path(folder) / "said.txt").open("w+b") as said:
                code = _run(answer, question, said, tick)
                said.seek(0)
                words = said.read().decode(errors="replace").strip()
        if code != 0:
            raise MeshError(_reason(code, words, depth))
        with answer.open("rb") as stream:
            vertices, faces, density = pickle.load(stream)
    return vertices, faces, density


def _run(answer: Path, question: IO[bytes], said: IO[bytes], tick: Tick) -> int:
    """Run the process to its end; return its exit code."""
    program = _PROGRAM.format(path=sys.path, answer=str(answer))
    hidden = int(getattr(subprocess, "CREATE_NO_WINDOW", 0))  # Windows would open a console
    with subprocess.Popen(
        [sys.executable, "-c", program],
        stdin=question,
        stdout=subprocess.DEVNULL,
        stderr=said,
        creationflags=hidden,
    ) as process:
        try:
            while True:
                tick(None)
                try:
                    return process.wait(_PAUSE)
                except subprocess.TimeoutExpired:
                    continue
        except BaseException:
            process.kill()
            raise


def _reason(code: int, words: str, depth: int) -> str:
    """Say why the process broke."""
    start = f"The reconstruction of the surface broke off (exit code {code})"
    lines = words.splitlines()
    last = next((line for line in reversed(lines) if _ERROR.match(line)), lines[-1] if lines else "").rstrip(
        ".:"
    )
    if code in _OUT_OF_MEMORY or "MemoryError" in last or "bad_alloc" in words:
        return f"{start} for want of memory: choose a depth below {depth}, or fewer points."
    return f"{start}: {last}." if last else f"{start}."


def main(answer: str) -> int:
    """Answer the question on the standard input in a file.

    Parameters
    ----------
    answer : str

    Returns
    -------
    int
        0.
    """
    found = reconstruct(*pickle.load(sys.stdin.buffer))
    with Path(answer).open("wb") as stream:
        pickle.dump(found, stream, pickle.HIGHEST_PROTOCOL)
    return 0
