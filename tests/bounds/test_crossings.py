import numpy as np
import pytest

from o3d_relief.bounds.crossings import crossings, edges_of
from shapes import bust, grid, joined, moved, sphere


def _needle(z):
    """A triangle whose upper edge leans across the middle of the plane z = 0."""
    return np.array([[-3.0, 21.0, -z], [5.0, 22.0, z], [5.0, 29.0, z]]), np.array([[0, 1, 2]])


def _found(shape):
    vertices, faces = shape
    return crossings(vertices, faces, edges_of(faces))


def test_edges_are_each_counted_once():
    _, faces = sphere(12)
    edges = edges_of(faces)
    assert len(edges) == len(faces) * 3 // 2
    assert (edges[:, 0] < edges[:, 1]).all()
    assert len(np.unique(edges, axis=0)) == len(edges)


def test_crossing_balls_cross_and_separate_ones_do_not():
    for distance, crosses in ((60.0, True), (101.0, False)):
        shape = joined(sphere(12), moved(sphere(12), (distance, 3.0, 1.0)))
        found = _found(shape)
        assert found.pierced(shape[0][:, 2]).any() == crosses
    shape = bust(20)
    assert not _found(shape).pierced(shape[0][:, 2]).any()


def test_stretches_lie_above_and_below():
    shape = joined(grid(2), _needle(1.0))
    found = _found(shape)
    gaps = found.gaps(shape[0][:, 2])
    assert len(found) == 2  # both edges at its tip pass through the plate
    assert gaps.min(axis=1) == pytest.approx(-1.0)
    assert gaps.max(axis=1) == pytest.approx(1.0)
    assert found.inside.sum(axis=2) == pytest.approx(1.0)
    assert found.pierced(shape[0][:, 2]).all()
    assert not found.pierced(np.where(np.arange(7) < 4, 0.0, 2.0)).any()


def test_contact_is_no_crossing():
    shape = joined(grid(2), _needle(5e-4))
    assert not _found(shape).pierced(shape[0][:, 2]).any()


def test_pairs_keep_what_was_above_above():
    before, faces = joined(grid(2), moved(_needle(1.0), (0, 0, 3.0)))
    after = before - np.where(np.arange(7) < 4, 0.0, 3.0)[:, None] * [0, 0, 1]
    found = crossings(after, faces, edges_of(faces))
    pairs = found.pairs(before[:, 2], after[:, 2])
    assert len(pairs) == 2 * len(found) == 4
    assert (pairs.gap > 1.9).all()
    upper, lower = pairs.heights(before[:, 2])
    assert upper - lower == pytest.approx(pairs.gap)
    upper, lower = pairs.heights(after[:, 2])
    assert sorted(upper - lower) == pytest.approx([-1.0, -1.0, 1.0, 1.0])


def test_pairs_of_what_touched_stay_on_the_side_they_prefer():
    before, faces = joined(grid(2), _needle(0.0))
    after = before.copy()
    after[4:, 2] = [-0.5, 2.0, 2.0]
    found = crossings(after, faces, edges_of(faces))
    pairs = found.pairs(before[:, 2], after[:, 2])
    assert pairs.gap == pytest.approx(0.0)
    upper, lower = pairs.heights(after[:, 2])
    assert (upper - lower).sum() > 0


def test_shallow_crossings_are_seen_where_asked_for():
    shape = joined(grid(2), _needle(5e-4))
    found = _found(shape)
    assert found.pierced(shape[0][:, 2], deep=1e-4).any()
    assert not found.pierced(shape[0][:, 2]).any()


def test_nothing_crosses_where_no_triangle_is_left():
    found = _found((np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)))
    assert len(found) == 0
    assert len(found.pierced(np.zeros(0))) == 0
