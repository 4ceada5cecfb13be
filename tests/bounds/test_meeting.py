import numpy as np

from o3d_relief.bounds.meeting import Boxes, combinations, meeting

_ENDS = np.array([[0.0, 0, 4, 4], [0, 4, 4, 0], [9, 9, 9, 8], [0, 2, 4, 2], [0, 3, 1.0, 3]])
"""A cross, an edge far off, a level edge through its middle, and one that ends before it."""


def _all(one, other):
    return np.arange(len(one))


def test_members_of_a_group_are_combined_with_each_other():
    groups = {3: [0, 4], 5: [1, 2, 3], 9: [4]}
    keys = [5 * group + member for group, members in groups.items() for member in members]
    both = combinations(np.array(keys + keys[:2]), 5, _all)
    assert sorted(map(tuple, both.T.tolist())) == [(0, 4), (1, 2), (1, 3), (2, 3)]


def test_members_of_many_large_groups_are_combined_with_each_other():
    rng = np.random.default_rng(3)
    group, member = rng.integers(0, 9, 4000), rng.integers(0, 900, 4000)
    both = combinations(900 * group + member, 900, _all)
    found = sorted(map(tuple, both.T.tolist()))
    members = [sorted(set(member[group == number].tolist())) for number in range(9)]
    expected = [(a, b) for some in members for at, a in enumerate(some) for b in some[at + 1 :]]
    assert found == sorted(expected)
    assert len(found) > 100_000


def test_nothing_is_combined_with_nothing():
    assert combinations(np.zeros(0, dtype=np.int64), 5, _all).shape == (2, 0)


def test_boxes_that_touch_are_near():
    one, other = np.array([0, 0, 0, 3]), np.array([1, 2, 4, 4])
    assert Boxes(_ENDS).near(one, other).tolist() == [0, 2]


def test_edges_meet_where_both_reach_beyond_the_other():
    one, other = (np.array(numbers) for numbers in ([3, 0, 0, 0, 3], [0, 1, 2, 4, 0]))
    one, other, share, other_share = meeting(_ENDS, one, other)
    assert np.stack([one, other]).tolist() == [[0, 3], [1, 0]]
    assert share.tolist() == other_share.tolist() == [0.5, 0.5]
