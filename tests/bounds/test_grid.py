import numpy as np
import pytest

from o3d_relief.bounds.grid import grid_pairs
from o3d_relief.bounds.lines import Lines
from shapes import grid, joined, moved


def _two_plates(gap=10.0):
    return joined(grid(11), moved(grid(5, size=40), (0, 0, gap)))


def test_grid_pairs_join_neighbours_on_a_line_only():
    vertices, faces = joined(grid(5), moved(grid(5), (0, 0, 4)), moved(grid(5), (0, 0, 20)))
    pairs = grid_pairs(Lines(vertices, faces), side=32)
    assert len(pairs) == 2 * 32 * 32
    assert sorted(set(np.round(pairs.gap).astype(int))) == [4, 16]


def test_lines_of_the_grid_meet_steep_triangles_exactly():
    """Rays in float32 miss a line by 1e-5 here, which a slope of 50 makes 5e-4 in z."""
    vertices, faces = grid(9)
    steep = np.column_stack([vertices[:, :2] + 1e3 / 7, 50.0 * vertices[:, 0]])
    others, other_faces = grid(8)
    above = np.column_stack([others[:, :2] + 1e3 / 7, 50.0 * others[:, 0] + 3.0])
    pairs = grid_pairs(Lines(*joined((steep, faces), (above, other_faces))), side=37)
    assert len(pairs) == 37 * 37
    assert pairs.gap == pytest.approx(3.0, abs=1e-9)


def test_pairs_that_cannot_have_turned_are_left_out_where_other_heights_are_given():
    vertices, faces = joined(grid(6), moved(grid(4, size=40.0), (3.0, 5.0, 10.0)))
    lines = Lines(vertices, faces)
    everything = grid_pairs(lines, side=64)
    tilted = np.where(vertices[:, 2] > 5.0, 0.5 * vertices[:, 0], vertices[:, 2])
    found = grid_pairs(lines, side=64, before=tilted)
    assert len(grid_pairs(lines, side=64, before=vertices[:, 2])) == 0
    assert 0 < len(found) < len(everything)
    turned = [int((np.subtract(*pairs.heights(tilted)) < 0.0).sum()) for pairs in (everything, found)]
    assert turned[0] == turned[1] > 0
