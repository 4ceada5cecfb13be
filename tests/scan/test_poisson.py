import os

import numpy as np
import pytest

from o3d_relief.errors import MeshError, ParameterError
from o3d_relief.scan.poisson import depth_for, poisson_surface


def ball(count=4000):
    points = np.random.default_rng(0).normal(size=(count, 3))
    return points / np.linalg.norm(points, axis=1, keepdims=True)


@pytest.mark.parametrize(
    ("extent", "spacing", "depth"), [(100, 1, 7), (1000, 1, 10), (1e9, 1, 11), (3, 1, 4)]
)
def test_cells_are_about_as_wide_as_the_spacing(extent, spacing, depth):
    assert depth_for(extent, spacing) == depth


@pytest.mark.parametrize("extent", [40.0, 57.0, 80.0, 113.0, 900.0])
def test_cells_lie_between_0_84_and_1_68_spacings(extent):
    assert 0.84 <= 1.1 * extent / 2 ** depth_for(extent, 1.0) <= 1.69


@pytest.mark.parametrize(("scale", "offset"), [(1.0, 0.0), (1e-6, 0.0), (1e4, 1e5)])
def test_a_ball_comes_back(scale, offset):
    vertices, faces, density = poisson_surface(ball() * scale + offset, ball(), depth=6, threads=1)
    radius = np.linalg.norm((vertices - offset) / scale, axis=1)
    assert np.abs(radius - 1.0).max() < 0.02
    assert len(density) == len(vertices)
    a, b, c = ((vertices - offset) / scale)[faces].transpose(1, 0, 2)
    assert (np.cross(b - a, c - a) * a).sum() / 6.0 == pytest.approx(4.0 / 3.0 * np.pi, rel=0.02)


def test_the_same_points_give_the_same_bytes():
    first, again = (poisson_surface(ball(), ball(), depth=6, threads=1) for _ in range(2))
    assert all(np.array_equal(one, other) for one, other in zip(first, again, strict=True))


def test_too_few_points():
    with pytest.raises(MeshError, match="at least 50 points, only 49 are left"):
        poisson_surface(ball(49), ball(49), depth=6, threads=1)


@pytest.mark.parametrize("direction", [[1.0, 0, 0], [1.0, 2, 3]])
def test_points_on_a_line(direction):
    points = np.linspace(0, 1, 200)[:, None] * direction
    with pytest.raises(MeshError, match="lie on one line"):
        poisson_surface(points, np.tile([0, 0, 1.0], (200, 1)), depth=6, threads=1)


def test_more_threads_than_processors():
    with pytest.raises(ParameterError, match="threads must be at most"):
        poisson_surface(ball(), ball(), depth=6, threads=(os.cpu_count() or 1) + 1)
