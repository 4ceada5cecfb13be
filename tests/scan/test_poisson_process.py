import os
import subprocess
import time

import numpy as np
import pytest

from o3d_relief.errors import Cancelled, MeshError
from o3d_relief.progress import silent
from o3d_relief.scan import poisson
from o3d_relief.scan.poisson import poisson_surface
from o3d_relief.scan.poisson_open3d import reconstruct
from o3d_relief.scan.poisson_process import reconstruct_apart


def ball(count):
    points = np.random.default_rng(0).normal(size=(count, 3))
    return points / np.linalg.norm(points, axis=1, keepdims=True)


def test_it_is_the_same_surface():
    points = ball(2000)
    here = reconstruct(points, points, 5, 1, 1.1)
    apart = reconstruct_apart(points, points, 5, 1, 1.1, silent)
    assert all(np.array_equal(one, other) for one, other in zip(here, apart, strict=True))


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
        if len(rounds) == 30:  # three seconds later it computes
            raise Cancelled

    with pytest.raises(Cancelled):
        poisson_surface(points, points, depth=9, threads=1, tick=tick)
    assert time.monotonic() - rounds[-1] < 2.0
    assert started[0].returncode not in (None, 0)  # it has gone


def test_a_process_that_breaks_is_told():
    points = ball(100)
    with pytest.raises(MeshError, match=r"broke off \(exit code -?\d+\).*choose a depth below 4"):
        reconstruct_apart(points, points[:50], 4, (os.cpu_count() or 1) + 64, 1.1, silent)
