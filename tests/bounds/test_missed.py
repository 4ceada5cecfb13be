import numpy as np
import pytest

from o3d_relief.bounds import missed
from o3d_relief.bounds.lines import Lines
from o3d_relief.bounds.missed import BetweenLines
from o3d_relief.bounds.pairs import vertex_pairs
from o3d_relief.bounds.rows import gap_rows
from shapes import bust, grid, joined, moved


def test_nothing_is_missed_where_nothing_moves():
    vertices, faces = bust(16)
    assert len(BetweenLines(vertices, faces).missed(vertices[:, 2])[1]) == 0


def test_sheets_that_pass_through_each_other_are_found_in_their_old_order():
    low, high = grid(6), moved(grid(4, size=40.0), (3.0, 5.0, 10.0))
    vertices, faces = joined(low, high)
    z = np.where(vertices[:, 2] > 5.0, 20.0 - 0.9 * vertices[:, 0], 15.0)  # tilted through the lower one
    rows, gap = BetweenLines(vertices, faces).missed(z)
    assert len(gap) > 0
    assert gap == pytest.approx(10.0)
    assert rows @ vertices[:, 2] == pytest.approx(gap)
    assert (rows @ z < 0.0).any()


def test_sheets_that_changed_places_as_a_whole_are_found():
    vertices, faces = joined(grid(6), moved(grid(4, size=40.0), (3.0, 5.0, 10.0)))
    z = np.where(vertices[:, 2] > 5.0, 4.0, 9.0)
    rows, gap = BetweenLines(vertices, faces).missed(z)
    assert gap == pytest.approx(10.0)
    assert rows @ z == pytest.approx(-5.0)


def test_what_lies_behind_the_plane_does_not_count():
    vertices, faces = joined(grid(6), moved(grid(4, size=40.0), (3.0, 5.0, 10.0)))
    z = np.where(vertices[:, 2] > 5.0, -4.0, -1.0)
    assert len(BetweenLines(vertices, faces).missed(z)[1]) == 0


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
    rows, gap = BetweenLines(vertices, faces).missed(np.where(right, tilted, swapped))
    assert len(gap) > 0
    assert (vertices[rows.indices, 0] < 100.0).all()


def test_a_wall_that_rises_through_what_it_touched_is_found_after_the_cut():
    # A sheet, and an upright wall whose upper edge lies in it: its triangle reaches behind S. Where one end
    # of that edge comes up, only the edge that the cut makes crosses the sheet.
    sheet = np.array([[0, 0, 10], [20, 0, 10], [20, 20, 10], [0, 20, 10.0]])
    wall = np.array([[10, 5, 10], [10, 15, 10], [10, 15, 0.0]])
    vertices = np.concatenate([sheet, wall])
    faces = np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6]])
    z = np.array([2, 2, 2, 2, 2.0, 2.5, -4.0])
    rows, gap = BetweenLines(vertices, faces).missed(z)
    assert len(gap) > 0
    assert rows @ vertices[:, 2] == pytest.approx(gap, abs=1e-9)
    assert (rows @ z < 0.0).any()
    z[5] = 2.0
    assert len(BetweenLines(vertices, faces).missed(z)[1]) == 0


def test_vertices_just_beside_an_outline_are_looked_at(monkeypatch):
    # A sheet that turns back at x = 0, and above it a plate whose corner stands just beside that outline.
    sheet = np.array(
        [[0, -10, 20], [0, 10, 20], [-20, -10, 24], [-20, 10, 24], [-20, -10, 10], [-20, 10, 10.0]]
    )
    plate = np.array([[5e-3, 0, 30], [20, -5, 30], [20, 5, 30.0]])
    vertices = np.concatenate([sheet, plate])
    faces = np.array([[0, 1, 2], [1, 3, 2], [0, 4, 1], [1, 4, 5], [6, 7, 8]])
    z = np.where(np.arange(9) > 5, 5.0, vertices[:, 2])
    between = BetweenLines(vertices, faces)
    assert len(between.missed(z)[1]) == 0
    # What rounding errors do in a millionth of a unit, in a hundredth.
    monkeypatch.setattr(missed, "_ASIDE", tuple((1e3 * x, 1e3 * y) for x, y in missed._ASIDE))
    rows, gap = between.missed(z)
    assert gap == pytest.approx(10.0, abs=0.01)
    assert rows @ z == pytest.approx(-15.0, abs=0.01)


def test_what_is_close_is_looked_at_first_and_found_the_same():
    # Two sheets far apart, of many faces, and beside them two that come to cross.
    low, high = moved(grid(24), (200.0, 0.0, 0.0)), moved(grid(24), (200.0, 0.0, 10.0))
    vertices, faces = joined(grid(6), moved(grid(4, size=40.0), (3.0, 5.0, 10.0)), low, high)
    pairs = vertex_pairs(Lines(vertices, faces))
    beside = vertices[:, 0] < 150.0
    z = np.where(beside & (vertices[:, 2] > 5.0), 5.0 - 0.5 * vertices[:, 0], vertices[:, 2] + 5.0)
    between = BetweenLines(vertices, faces, gap_rows(pairs, len(vertices)))
    rows, gap = between.missed(z)
    assert (vertices[rows.indices, 0] < 150.0).all()
    plainly, same = BetweenLines(vertices, faces).missed(z)
    assert len(gap) > 0
    assert np.sort(rows @ z) == pytest.approx(np.sort(plainly @ z), abs=1e-4)
    assert np.sort(gap) == pytest.approx(np.sort(same), abs=1e-4)
    assert len(between._close_by(z)) == len(gap)
    assert len(between._close_by(vertices[:, 2])) == 0


def test_what_has_turned_is_found_where_much_crosses_elsewhere():
    low, high = grid(30), moved(grid(30, size=90.0), (3.0, 5.0, 10.0))
    beside = [
        moved(part, (200.0, 0.0, 0.0)) for part in (grid(6), moved(grid(4, size=40.0), (3.0, 5.0, 10.0)))
    ]
    vertices, faces = joined(low, high, *beside)
    upper, right = vertices[:, 2] > 5.0, vertices[:, 0] > 100.0
    tilted = np.where(upper, 20.0 - 0.1 * vertices[:, 0], 20.0)
    swapped = np.where(upper, 4.0, 9.0)
    rows, gap = BetweenLines(vertices, faces).missed(np.where(right, swapped, tilted))
    at_right = (vertices[rows.indices, 0] > 100.0).reshape(len(gap), -1).all(axis=1)
    assert (~at_right).sum() > 200
    assert at_right.any()
