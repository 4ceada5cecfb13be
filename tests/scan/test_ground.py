import numpy as np
import pytest

from o3d_relief.errors import MeshError
from o3d_relief.scan.ground import find_ground

UP = np.array([0.0, 0, 1])


def table(count=4000, seed=0):
    """A level square at z = 0, a little rough, and half a ball that stands on it."""
    random = np.random.default_rng(seed)
    square = random.random((count, 3)) * [4, 4, 0] - [2, 2, 0]
    square[:, 2] += random.normal(scale=0.01, size=count)
    ball = random.normal(size=(count, 3))
    ball /= np.linalg.norm(ball, axis=1, keepdims=True)
    ball[:, 2] = np.abs(ball[:, 2])
    return np.concatenate([square, ball]), np.concatenate([np.tile(UP, (count, 1)), ball])


def test_the_table_goes_and_the_object_stays():
    points, normals = table()
    ground = find_ground(points, normals, UP, 0.05, seed=0)
    assert ground[:4000].mean() > 0.999
    assert np.array_equal(ground[4000:], points[4000:, 2] <= 0.1) or ground[4000:].mean() < 0.15
    assert not ground[4000:][points[4000:, 2] > 0.15].any()


def test_a_table_that_leans_a_little_and_what_lies_below_it():
    points, normals = table()
    lean = np.array([[1, 0, 0], [0, np.cos(0.2), -np.sin(0.2)], [0, np.sin(0.2), np.cos(0.2)]])
    below = np.random.default_rng(1).random((200, 3)) * 0.5 - [0, 0, 2]
    points, normals = (
        np.concatenate([points, below]) @ lean.T,
        np.concatenate([normals, table()[1][:200]]) @ lean.T,
    )
    ground = find_ground(points, normals, UP, 0.05, seed=0)
    assert ground[:4000].mean() > 0.99
    assert ground[8000:].all()


def test_the_same_seed_finds_the_same_ground():
    points, normals = table()
    first, again = (find_ground(points, normals, UP, 0.05, seed=7) for _ in range(2))
    assert np.array_equal(first, again)


def test_a_ball_stands_on_nothing():
    ball = np.random.default_rng(0).normal(size=(3000, 3))
    ball /= np.linalg.norm(ball, axis=1, keepdims=True)
    with pytest.raises(MeshError, match="No ground was found"):
        find_ground(ball, ball, UP, 0.001, seed=0)


def test_walls_are_no_ground():
    points, normals = table()
    with pytest.raises(MeshError, match="No ground was found"):
        find_ground(points[:4000], normals[:4000], np.array([1.0, 0, 0]), 0.05, seed=0)


def test_nothing_but_ground():
    points, normals = table()
    with pytest.raises(MeshError, match="Nothing but ground was found"):
        find_ground(points[:4000], normals[:4000], UP, 0.05, seed=0)
