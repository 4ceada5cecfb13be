import numpy as np
import pytest

from o3d_relief.bounds.missed import BetweenLines
from shapes import bust, grid, joined, moved


def test_nothing_is_missed_where_nothing_moves():
    vertices, faces = bust(16)
    assert len(BetweenLines(vertices, faces).missed_pairs(vertices[:, 2])) == 0


def test_sheets_that_pass_through_each_other_are_found_in_their_old_order():
    low, high = grid(6), moved(grid(4, size=40.0), (3.0, 5.0, 10.0))
    vertices, faces = joined(low, high)
    z = np.where(vertices[:, 2] > 5.0, 20.0 - 0.9 * vertices[:, 0], 15.0)  # tilted through the lower one
    found = BetweenLines(vertices, faces).missed_pairs(z)
    assert len(found) > 0
    assert found.gap == pytest.approx(10.0)
    assert (found.upper.min(axis=1) >= 36).all()
    upper, lower = found.heights(z)
    assert (upper < lower).any()


def test_sheets_that_changed_places_as_a_whole_are_found():
    vertices, faces = joined(grid(6), moved(grid(4, size=40.0), (3.0, 5.0, 10.0)))
    z = np.where(vertices[:, 2] > 5.0, 4.0, 9.0)
    found = BetweenLines(vertices, faces).missed_pairs(z)
    assert len(found) > 0
    assert found.gap == pytest.approx(10.0)


def test_what_lies_behind_the_plane_does_not_count():
    vertices, faces = joined(grid(6), moved(grid(4, size=40.0), (3.0, 5.0, 10.0)))
    z = np.where(vertices[:, 2] > 5.0, -4.0, -1.0)
    assert len(BetweenLines(vertices, faces).missed_pairs(z)) == 0


def test_what_crosses_behind_the_plane_hides_nothing_in_front():
    # Two sheets that changed places in front of S, and beside them two that cross behind it.
    low, high = grid(6), moved(grid(4, size=40.0), (3.0, 5.0, 10.0))
    beside = [moved(part, (200.0, 0.0, 0.0)) for part in (low, high)]
    vertices, faces = joined(low, high, *beside)
    upper, right = vertices[:, 2] > 5.0, vertices[:, 0] > 100.0
    swapped, tilted = (
        np.where(upper, 4.0, 9.0),
        np.where(upper, -20.0 - 0.1 * (vertices[:, 0] - 203.0), -20.0),
    )
    found = BetweenLines(vertices, faces).missed_pairs(np.where(right, tilted, swapped))
    assert len(found) > 0
    assert (vertices[found.upper, 0] < 100.0).all()
