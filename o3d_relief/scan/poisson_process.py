"""Poisson reconstruction in a process of its own, which can be called off."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from o3d_relief.errors import MeshError
from o3d_relief.progress import Tick
from o3d_relief.scan.poisson_open3d import Surface, reconstruct

__all__ = ["main", "reconstruct_apart"]

_PAUSE = 0.1  # seconds between two looks at whether the work is called off


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
    home = str(Path(__file__).parents[2])
    search = os.pathsep.join(filter(None, [home, os.environ.get("PYTHONPATH", "")]))
    words = pickle.dumps((points, normals, depth, threads, scale), protocol=pickle.HIGHEST_PROTOCOL)
    with subprocess.Popen(
        [sys.executable, "-m", "o3d_relief.scan.poisson_process"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env={**os.environ, "PYTHONPATH": search},
    ) as process:
        try:
            answer = _answer(process, words, tick)
        except BaseException:
            process.kill()
            raise
    if process.returncode != 0:
        raise MeshError(
            f"The reconstruction of the surface broke off (exit code {process.returncode}), most likely for "
            f"want of memory: choose a depth below {depth}, or fewer points."
        )
    vertices, faces, density = pickle.loads(answer)
    return vertices, faces, density


def _answer(process: subprocess.Popen[bytes], words: bytes, tick: Tick) -> bytes:
    """Give the process its input and wait for its output."""
    to_send: bytes | None = words
    while True:
        tick(None)
        try:
            return process.communicate(to_send, timeout=_PAUSE)[0]
        except subprocess.TimeoutExpired:
            to_send = None  # it is sent as far as the process takes it


def main() -> int:
    """Answer one question from the standard input on the standard output.

    Returns
    -------
    int
        0.
    """
    with os.fdopen(os.dup(1), "wb") as answer:
        os.dup2(2, 1)  # whatever the libraries say shall not come in between
        found = reconstruct(*pickle.load(sys.stdin.buffer))
        pickle.dump(found, answer, protocol=pickle.HIGHEST_PROTOCOL)
    return 0


if __name__ == "__main__":
    sys.exit(main())
