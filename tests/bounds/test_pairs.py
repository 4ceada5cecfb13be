import numpy as np
import pytest

from o3d_relief.bounds.grid import grid_pairs
from o3d_relief.bounds.lines import Lines
from o3d_relief.bounds.pairs import close_pairs, vertex_pairs
from shapes import bust, grid, joined, moved


def _two_plates(gap=10.0):
    return joined(grid(11), moved(grid(5, size=40), (0, 0, gap)))


@pytest.mark.parametrize("find", [vertex_pairs, lambda lines: grid_pairs(lines, side=64)])
def test_plate_above_plate(find):
    vertices, faces = _two_plates()
    pairs = find(Lines(vertices, faces))
    assert len(pairs) > 20
    assert pairs.gap == pytest.approx(10.0, abs=1e-4)
    assert (pairs.upper >= 121).all()
    assert (pairs.lower < 121).all()


def test_points_of_a_pair_lie_above_each_other():
    vertices, faces = bust()
    for pairs in (vertex_pairs(Lines(vertices, faces)), grid_pairs(Lines(vertices, faces), side=128)):
        upper = np.einsum("pcx,pc->px", vertices[pairs.upper], pairs.upper_weights)
        lower = np.einsum("pcx,pc->px", vertices[pairs.lower], pairs.lower_weights)
        assert upper[:, :2] == pytest.approx(lower[:, :2], abs=2e-3)
        assert upper[:, 2] - lower[:, 2] == pytest.approx(pairs.gap)
        assert (pairs.gap > 0).all()


def test_difference_is_linear_in_the_heights():
    vertices, faces = bust()
    pairs = vertex_pairs(Lines(vertices, faces))
    z = np.random.default_rng(0).normal(size=len(vertices))
    upper, lower = pairs.heights(z)
    assert pairs.difference(len(z)) @ z == pytest.approx(upper - lower)
    assert pairs.difference(len(z)) @ vertices[:, 2] == pytest.approx(pairs.gap)


@pytest.mark.parametrize(("gap", "there"), [(8e-4, True), (3e-4, False), (3e-3, False)])
def test_what_is_too_close_for_the_next_surface(gap, there):
    vertices, faces = joined(grid(9), moved(grid(5, size=33.3), (1.7, 0.9, gap)))
    pairs = close_pairs(Lines(vertices, faces))
    assert (len(pairs) >= 25) == there  # every vertex of the smaller plate
    assert pairs.gap == pytest.approx(gap, abs=2e-5)
    assert (len(vertex_pairs(Lines(vertices, faces))) > 0) == (gap > 1e-3)


def test_pairs_of_a_part_get_the_numbers_of_the_whole():
    vertices, faces = joined(grid(3), moved(grid(3), (1.0, 1.0, 5.0)))
    pairs = vertex_pairs(Lines(vertices, faces))
    number = 10 + 2 * np.arange(len(vertices))
    whole = np.zeros(10 + 2 * len(vertices))
    whole[number] = vertices[:, 2]
    renumbered = pairs.renumbered(number)
    assert len(pairs) > 0
    assert np.subtract(*renumbered.heights(whole)) == pytest.approx(pairs.gap)
