import numpy as np
import pytest

from o3d_relief.scan.neighbours import find_neighbours, local_spacings, outliers, thin
from shapes import grid


def plane(count, seed=0):
    points = np.random.default_rng(seed).random((count, 3))
    points[:, 2] = 0.0
    return points


def test_neighbours_are_the_nearest_of_the_others():
    points = np.random.default_rng(1).normal(size=(60, 3))
    found = find_neighbours(points)
    distance = np.linalg.norm(points[:, None] - points[None], axis=2)
    np.fill_diagonal(distance, np.inf)
    assert np.array_equal(found.index, np.argsort(distance, axis=1)[:, :20])
    assert np.allclose(found.distance, np.sort(distance, axis=1)[:, :20])


def test_a_point_is_no_neighbour_of_itself_even_among_many_at_one_place():
    found = find_neighbours(np.zeros((50, 3)))
    assert not (found.index == np.arange(50)[:, None]).any()
    assert found.index.shape == (50, 20)


@pytest.mark.parametrize("points", [grid(60, size=59.0)[0], 60.0 * plane(3600)])
def test_spacing_is_the_side_of_the_square_of_a_point(points):
    assert np.median(local_spacings(find_neighbours(points))) == pytest.approx(1.0, rel=0.15)


def test_two_scans_laid_over_each_other_have_half_the_square():
    points = grid(40, size=39.0)[0]
    both = np.concatenate([points, points + 1e-6])
    assert np.median(local_spacings(find_neighbours(both))) == pytest.approx(np.sqrt(0.5), rel=0.15)


def test_outliers_are_found_and_a_threefold_spacing_is_none():
    distance = np.array(100 * [1.0] + 30 * [3.0] + [3.5, 50.0])
    assert np.flatnonzero(outliers(distance, 4.0)).tolist() == [130, 131]


def test_outliers_do_not_depend_on_the_unit():
    distance = np.random.default_rng(0).lognormal(size=500)
    assert np.array_equal(outliers(distance, 2.0), outliers(1e9 * distance, 2.0))


def test_thinning_leaves_one_point_in_each_cell():
    points = plane(5000)
    kept = thin(points, 0.1)
    cells = np.floor((points - points.min(axis=0)) / 0.1).astype(int)
    assert len(kept) == len(np.unique(cells, axis=0)) == len(np.unique(cells[kept], axis=0))
    assert (np.diff(kept) > 0).all()


def test_thinning_by_nothing_keeps_all():
    assert thin(plane(10), 0.0).tolist() == list(range(10))
