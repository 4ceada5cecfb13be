import numpy as np

from o3d_relief.bounds.gaps import out_of_order, required_gaps, spare, wanted_gaps, worst_of_stacks
from o3d_relief.bounds.grid import grid_pairs
from o3d_relief.bounds.lines import Lines
from shapes import grid, joined, moved


def _layers():
    """Three plates above each other, 10 apart, and what is stacked on a grid of lines."""
    plates = joined(grid(5), *[moved(grid(5), (0, 0, z)) for z in (10, 20)])
    return plates[0], grid_pairs(Lines(*plates), side=16)


def test_what_lies_behind_the_plane_does_not_count():
    vertices, pairs = _layers()
    assert not out_of_order(pairs, -vertices[:, 2] - 1.0).any()
    assert out_of_order(pairs, -vertices[:, 2] + 50.0).all()


def test_gaps_that_were_smaller_before_are_not_widened():
    vertices, pairs = _layers()
    assert np.allclose(required_gaps(pairs, 4.0), 4.0)
    assert np.allclose(required_gaps(pairs, 40.0), pairs.gap)
    assert not out_of_order(pairs, vertices[:, 2], min_gap=40.0).any()
    assert out_of_order(pairs, 0.5 * vertices[:, 2] + 1.0, min_gap=6.0).all()


def test_pairs_are_set_further_apart_than_they_must_be_and_then_have_room():
    vertices, pairs = _layers()
    assert (wanted_gaps(pairs, 4.0) > 4.0).all()
    assert (wanted_gaps(pairs, 40.0) == pairs.gap).all()
    assert spare(pairs, vertices[:, 2], 4.0).all()
    assert not spare(pairs, 0.4 * vertices[:, 2], 4.0).any()


def test_one_pair_stands_for_two_triangles_above_each_other():
    _, pairs = _layers()
    wrong = np.ones(len(pairs), dtype=bool)
    lacking = np.arange(len(pairs), dtype=float)
    worst = worst_of_stacks(pairs, lacking, wrong)
    stacks = np.concatenate([pairs.upper, pairs.lower], axis=1)
    assert worst.sum() == len(np.unique(stacks, axis=0))
    for k in np.flatnonzero(worst):
        assert lacking[k] == lacking[(stacks == stacks[k]).all(axis=1)].max()
