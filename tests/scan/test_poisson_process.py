import os
import subprocess
import time

import numpy as np
import pytest

from o3d_relief.errors import Cancelled, MeshError
from o3d_relief.progress import silent
from o3d_relief.scan import poisson, poisson_process
from o3d_relief.scan.poisson import poisson_surface
from o3d_relief.scan.poisson_open3d import reconstruct
from o3d_relief.scan.poisson_process import reconstruct_apart


def ball(count):
    points = np.random.default_rng(0).normal(size=(count, 3))
    return points / np.linalg.norm(points, axis=1, keepdims=True)


def test_it_is_the_same_surface(monkeypatch, tmp_path):
    # More than fits into a pipe; and what lies in the working folder is not taken for a library.
    (tmp_path / "random.py").write_text("raise ImportError")
    monkeypatch.chdir(tmp_path)
    points = ball(6000)
    normals = points + np.random.default_rng(1).normal(scale=0.01, size=points.shape)
    here = reconstruct(points, normals, 5, 1, 1.1)
    apart = reconstruct_apart(points, normals, 5, 1, 1.1, silent)
    assert all(np.array_equal(one, other) for one, other in zip(here, apart, strict=True))


def test_many_points_come_back(monkeypatch):
    monkeypatch.setattr(poisson, "reconstruct", None)
    points = ball(20_001)
    vertices, _, _ = poisson_surface(points, points.copy(), depth=6, threads=1)
    assert np.abs(np.linalg.norm(vertices, axis=1) - 1.0).max() < 0.02


def test_many_points_are_called_off_at_once(monkeypatch):
    # In this process nothing could interrupt it.
    monkeypatch.setattr(poisson, "reconstruct", None)
    points, rounds, started = ball(30_000), [], []
    start = subprocess.Popen
    monkeypatch.setattr(
        subprocess, "Popen", lambda *words, **how: started.append(start(*words, **how)) or started[-1]
    )

    def tick(_share):
        rounds.append(time.monotonic())
        if len(rounds) == 30:  # three seconds later
            raise Cancelled

    with pytest.raises(Cancelled):
        poisson_surface(points, points.copy(), depth=9, threads=1, tick=tick)
    assert time.monotonic() - rounds[-1] < 2.0
    assert started[0].returncode not in (None, 0)  # it has gone


def test_a_process_that_breaks_is_told():
    points = ball(100)
    with pytest.raises(MeshError, match=r"broke off \(exit code -?\d+\)"):
        reconstruct_apart(points, points, 4, (os.cpu_count() or 1) + 64, 1.1, silent)
    with pytest.raises(MeshError, match=r"broke off \(exit code 1\): TypeError: .*incompatible"):
        reconstruct_apart(points, points, -1, 1, 1.1, silent)


@pytest.mark.parametrize(("code", "words"), [(-9, ""), (137, ""), (1, "Traceback\nMemoryError: 3 GiB")])
def test_want_of_memory_is_told(code, words):
    assert "for want of memory: choose a depth below 9" in poisson_process._reason(code, words, 9)
