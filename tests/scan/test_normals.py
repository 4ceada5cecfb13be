import numpy as np
import pytest

from o3d_relief.scan.neighbours import find_neighbours
from o3d_relief.scan.normals import agreement, check_normals, estimate_normals
from shapes import sphere, turn

EVERY = np.ones(1200, dtype=bool)


def estimated(points, usable=None):
    usable = np.ones(len(points), dtype=bool) if usable is None else usable
    return estimate_normals(points, find_neighbours(points), usable)


def test_a_plane_has_its_normal():
    points = np.random.default_rng(0).random((300, 3)) * [1, 1, 0]
    rotation = turn(3)
    np.testing.assert_allclose(np.abs(estimated(points @ rotation.T) @ rotation[:, 2]), 1.0, atol=1e-12)


def test_normals_of_a_ball_point_along_its_radii():
    points = np.random.default_rng(0).normal(size=(4000, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    along = np.abs((estimated(points) * points).sum(axis=1))
    assert np.percentile(along, 1) > np.cos(np.radians(8))


def test_unusable_points_bend_nothing_and_have_no_normal():
    points = np.random.default_rng(0).random((300, 3)) * [1, 1, 0]
    points[:30, 2] = 0.05
    usable = np.arange(300) >= 30
    normals = estimated(points, usable)
    assert not normals[:30].any()
    np.testing.assert_allclose(np.abs(normals[30:, 2]), 1.0)


def test_points_on_a_line_have_no_normal():
    line = np.linspace(0, 1, 50)[:, None] * [1.0, 2.0, 3.0]
    assert not estimated(line).any()


def test_blocks_do_not_show(monkeypatch):
    points = sphere(12)[0]
    whole = estimated(points)
    monkeypatch.setattr("o3d_relief.scan.normals._BLOCK", 37)
    assert np.array_equal(estimated(points), whole)


def test_normals_are_brought_to_unit_length():
    given = np.array([[0, 0, 5], [0, 3e-200, 0], [1e200, 0, 0], [0, 0, 0], [np.nan, 0, 1], [0, 0, np.inf]])
    wanted = [[0, 0, 1], [0, 1, 0], [1, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0]]
    np.testing.assert_allclose(check_normals(given, 6), wanted)


@pytest.mark.parametrize("normals", [None, np.ones((5, 3))])
def test_normals_that_are_not_those_of_the_points_are_none(normals):
    assert check_normals(normals, 6) is None


def test_agreement_is_within_45_degrees_either_way():
    angles = np.radians([0, 44, 46, 134, 136, 180])
    normals = np.stack([np.sin(angles), 0 * angles, np.cos(angles)], axis=1)
    assert agreement(normals, np.tile([0, 0, 1.0], (6, 1))).tolist() == [True, True, False, False, True, True]
