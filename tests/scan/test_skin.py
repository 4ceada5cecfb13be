import numpy as np
import pytest
from scipy.spatial import cKDTree

from o3d_relief.scan.skin import carry_colors, keep_parts, support, used_only
from shapes import grid, joined, moved

DENSE = np.full(61 * 61, 8.0)


def distances(vertices, missing):
    """Distances of a grid of spacing 1 to those of its vertices that are not missing."""
    return cKDTree(vertices[~missing]).query(vertices)[0]


def test_the_surface_around_an_open_scan_goes():
    vertices, faces = grid(61, size=60.0)
    missing = np.abs(vertices[:, 0]) > 15.5
    inside = support(faces, distances(vertices, missing), DENSE, 10.0)
    assert (inside[np.abs(vertices[:, 0]) <= 14.0] > 0).all()
    assert (inside[np.abs(vertices[:, 0]) >= 18.0] < 0).all()


@pytest.mark.parametrize(("radius", "closed"), [(3.0, True), (8.0, False)])
def test_small_holes_are_closed_and_large_ones_stay(radius, closed):
    vertices, faces = grid(61, size=60.0)
    missing = np.linalg.norm(vertices, axis=1) < radius
    inside = support(faces, distances(vertices, missing), DENSE, 10.0)
    assert (inside[1860] > 0) == closed
    assert (inside[~missing] >= -0.2).all()


def test_no_hole_is_closed_if_none_may_be():
    vertices, faces = grid(61, size=60.0)
    missing = np.linalg.norm(vertices, axis=1) < 5.0
    assert support(faces, distances(vertices, missing), DENSE, 0.0)[1860] < 0


def test_a_bubble_around_a_stray_point_goes():
    vertices, faces = joined(grid(61, size=60.0), moved(grid(5, size=4.0), (0, 0, 30)))
    density = np.append(DENSE, np.full(25, 4.0))
    inside = support(faces, np.zeros(len(vertices)), density, 10.0)
    assert (inside[:3721] > 0.5).all()
    assert (inside[3721:] == -1.0).all()


def test_parts_are_kept_by_their_area():
    vertices, faces = joined(
        grid(5, size=10.0), moved(grid(5, size=5.0), (20, 0, 0)), moved(grid(9, size=1.0), (40, 0, 0))
    )
    for share, parts in ((0.0, 3), (0.009, 3), (0.02, 2), (0.25, 2), (0.3, 1), (1.0, 1)):
        kept, dropped = keep_parts(vertices, faces, share)
        assert dropped == 3 - parts
        assert kept.sum() == [32, 64, 192][parts - 1]


@pytest.mark.parametrize("factor", [1e-200, 1e90])
def test_parts_of_any_size_have_areas(factor):
    vertices, faces = joined(grid(5), moved(grid(5, size=1.0), (200, 0, 0)))
    kept, dropped = keep_parts(factor * vertices, faces, 0.5)
    assert (kept.sum(), dropped) == (32, 1)


def test_one_of_two_equal_parts_is_the_largest():
    vertices, faces = joined(grid(5), moved(grid(5), (200, 0, 0)))
    assert keep_parts(vertices, faces, 1.0)[0].sum() == 32


def test_unused_vertices_are_left_out():
    index, faces = used_only(np.array([[5, 2, 9], [2, 5, 7]]), 12)
    assert index.tolist() == [2, 5, 7, 9]
    assert index[faces].tolist() == [[5, 2, 9], [2, 5, 7]]


def test_colors_at_the_points_are_theirs_and_between_them_a_mean():
    points = grid(10)[0]
    colors = np.random.default_rng(0).random((100, 3))
    assert np.abs(carry_colors(points, points, colors) - colors).max() < 0.01
    middle = carry_colors(points[[0]] / 2 + points[[11]] / 2, points, colors)
    np.testing.assert_allclose(middle[0], colors[[0, 1, 10, 11]].mean(axis=0))


def test_one_point_colors_everything():
    assert carry_colors(np.zeros((2, 3)), np.ones((1, 3)), np.full((1, 3), 0.3)).tolist() == [[0.3] * 3] * 2
