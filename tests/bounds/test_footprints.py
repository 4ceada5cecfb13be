import numpy as np
import pytest

from o3d_relief.bounds.crossings import edges_of
from o3d_relief.bounds.footprints import footprints, projected
from shapes import grid, joined, moved


def test_edges_on_top_of_each_other_have_one_footprint():
    vertices, faces = joined(grid(2, size=50), moved(grid(2, size=50), (0, 0, 7)))
    edges = edges_of(faces)
    prints = footprints(vertices, faces, edges, np.arange(len(edges)))
    assert len(prints.first) == 5  # four sides and the diagonal
    assert np.diff(prints.begin).tolist() == [2] * 5
    assert (prints.left & prints.right).sum() == 1
    number = prints.numbers()
    members, of = prints.members(np.arange(5))
    assert np.array_equal(number[members], of)
    both = prints.combined(prints.first[:1], prints.first[1:2])
    assert both.shape == (2, 4)
    assert set(number[both[0]]) == {0}
    assert set(number[both[1]]) == {1}


def test_upright_edges_have_none():
    vertices = np.array([[0.0, 0, 0], [0, 0, 5], [4, 0, 0]])
    faces = np.array([[0, 1, 2]])
    edges = edges_of(faces)
    prints = footprints(vertices, faces, edges, np.arange(3))
    assert prints.edge.tolist() == [1, 2]
    assert prints.numbers().tolist() == [-1, 0, 0]


def test_points_along_an_edge():
    plane = np.array([[0.0, 0], [4, 0], [1, 2]])
    share, off, length = projected(plane, np.array([[0, 1]]), np.array([2]))
    assert (share[0], off[0], length[0]) == pytest.approx((0.25, 2.0, 4.0))
