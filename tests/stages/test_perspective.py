import numpy as np
import pytest

from o3d_relief import ParameterError
from o3d_relief.stages.perspective import forced_perspective
from shapes import bust


def test_hand_numbers():
    vertices = np.array([[4.0, 2, 0], [4, 2, 10], [4, 2, 5]])
    moved = forced_perspective(vertices, (0, 0, -10), view_plane=10)
    assert moved.tolist() == [[2, 1, 0], [4, 2, 10], [3, 1.5, 5]]


def test_infinitely_far_is_the_identity():
    vertices, _ = bust(12)
    assert np.array_equal(forced_perspective(vertices, (3, 4, -np.inf)), vertices)


def test_line_parallel_to_the_view_goes_through_the_vanishing_point():
    z = np.linspace(0, 40, 9)
    line = np.stack([np.full(9, 7.0), np.full(9, -3.0), z], axis=1)
    g = np.array([1.0, 2.0, -60.0])
    moved = forced_perspective(line, tuple(g))
    along = moved - g
    assert np.cross(along, along[0]) == pytest.approx(0.0, abs=1e-9)
    assert np.array_equal(moved[:, 2], z)


def test_wrong_points_are_named():
    vertices = np.array([[0, 0, 0], [1, 1, 30.0]])
    with pytest.raises(ParameterError, match="behind the relief plane"):
        forced_perspective(vertices, (0, 0, 1))
    with pytest.raises(ParameterError, match="behind the relief plane"):
        forced_perspective(vertices, (0, 0, -1e-9))
    with pytest.raises(ParameterError, match="in front of the scene"):
        forced_perspective(vertices, (0, 0, -10), view_plane=20)
