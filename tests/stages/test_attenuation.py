import numpy as np
import pytest
import scipy.sparse as sp

import oracle
from o3d_relief.stages.attenuation import (
    actions,
    attenuate,
    differentials,
    nearest_neighbours,
    new_heights,
    relative_differentials,
    select_points,
)


def _points(count, seed=0):
    rng = np.random.default_rng(seed)
    return np.column_stack([rng.uniform(-50, 50, (count, 2)), rng.uniform(1, 40, count)])


def test_point_is_the_lowest_visible_vertex_of_its_cluster():
    vertices = np.array([[0, 0, 5], [1, 0, 3], [2, 0, 1], [9, 0, 4], [9, 1, 8.0]])
    visible = np.array([True, True, False, True, True])
    labels = np.array([0, 0, 0, 2, 2])
    index, cluster = select_points(vertices, visible, labels, np.array([[1, 0], [5, 5], [9, 0.0]]))
    assert index.tolist() == [1, 3]
    assert cluster.tolist() == [0, 2]


def test_on_a_flat_floor_the_point_is_in_the_middle():
    vertices = np.array([[0, 0, 3], [4, 0, 3 + 1e-12], [5, 0, 3], [9, 0, 3]])
    index, _ = select_points(vertices, np.ones(4, bool), np.zeros(4, int), np.array([[4.4, 0.0]]))
    assert index.tolist() == [1]


def test_neighbours_agree_with_a_search_by_hand():
    points = _points(30)
    adjacency = nearest_neighbours(points[:, :2], symmetric=True).toarray()
    expected = np.zeros((30, 30))
    for i, near in enumerate(oracle.neighbours(points)):
        expected[i, list(near)] = 1
    assert np.array_equal(adjacency, expected)


def test_four_neighbours_or_all_there_are():
    assert (nearest_neighbours(_points(30)[:, :2], symmetric=False).sum(axis=1) == 4).all()
    assert (nearest_neighbours(_points(3)[:, :2], symmetric=False).sum(axis=1) == 2).all()
    assert nearest_neighbours(_points(1)[:, :2], symmetric=False).nnz == 0


def test_no_point_is_its_own_neighbour_even_at_one_position():
    adjacency = nearest_neighbours(np.zeros((7, 2)), symmetric=False)
    assert not adjacency.diagonal().any()
    assert (adjacency.sum(axis=1) == 4).all()


def test_differentials_by_hand():
    neighbours = sp.csr_array(np.array([[0, 1, 1], [1, 0, 0], [1, 0, 0.0]]))
    assert differentials(np.array([6.0, 1, 3]), neighbours).tolist() == [4.0, -5.0, -3.0]


def test_relative_differentials_without_a_range():
    assert relative_differentials(np.array([2.0, 2.0, 2.0 + 1e-9])).tolist() == [0, 0, 0]
    assert relative_differentials(np.array([3.0])).tolist() == [0]


def test_lowest_point_is_always_attached():
    found = actions(np.array([0.0, 0.5, 1.0]), discard_above=0.6, attach_below=0.0)
    assert found.tolist() == ["attach", "scale", "discard"]


def test_attenuation_function():
    x = np.linspace(-50, 50, 201)
    scaled = attenuate(x, np.full(201, 0.2))
    assert scaled == pytest.approx([np.arctan(0.2 * v) / 0.2 for v in x])
    assert (np.abs(scaled) <= np.abs(x)).all()
    assert (np.diff(scaled) > 0).all()
    assert attenuate(x, np.zeros(201)).tolist() == x.tolist()
    assert attenuate(x, np.full(201, 1e-12)) == pytest.approx(x)


@pytest.mark.parametrize("seed", range(4))
def test_new_heights_minimise_the_cost_within_the_bounds(seed):
    points = _points(24, seed)
    rho = relative_differentials(
        differentials(points[:, 2], nearest_neighbours(points[:, :2], symmetric=False))
    )
    action = actions(rho, discard_above=1.0, attach_below=0.3)
    found = new_heights(points, rho, action, np.full(24, 0.2))
    best = found.new_height
    assert (best >= 0).all()
    assert (best <= points[:, 2]).all()
    energy = oracle.heights_energy(points, found.action == "attach", 0.2, best)
    rng = np.random.default_rng(seed)
    for step in (1.0, 0.1, 1e-3):
        for _ in range(60):
            other = np.clip(best + rng.normal(0, step, 24) * (rng.random(24) < 0.3), 0, points[:, 2])
            assert oracle.heights_energy(points, found.action == "attach", 0.2, other) >= energy - 1e-9


def test_discarded_points_are_gone():
    points = _points(20)
    rho = np.linspace(0, 1, 20)
    action = actions(rho, discard_above=0.6, attach_below=0.3)
    found = new_heights(points, rho, action, np.full(20, 0.2))
    kept = action != "discard"
    assert np.array_equal(np.isnan(found.new_height), ~kept)
    alone = new_heights(points[kept], rho[kept], action[kept], np.full(kept.sum(), 0.2))
    assert found.new_height[kept] == pytest.approx(alone.new_height, abs=1e-12)


def test_group_without_attached_point_gets_its_lowest():
    left, right = _points(8, 1), _points(8, 2)
    left[:, 0] -= 500
    right[:, 0] += 500
    points = np.concatenate([left, right])
    rho = np.concatenate([np.full(8, 0.1), 0.5 + 0.01 * np.arange(8)])
    action = actions(rho, discard_above=0.6, attach_below=0.3)
    assert (action[8:] == "scale").all()
    found = new_heights(points, rho, action, np.full(16, 0.2))
    assert found.groups_attached == 1
    assert found.action[8] == "attach"
    assert (found.action[9:] == "scale").all()


def test_points_on_the_plane_stay_there():
    points = _points(12)
    points[[2, 5], 2] = 0.0
    rho = np.linspace(0, 0.5, 12)
    found = new_heights(points, rho, actions(rho, discard_above=0.6, attach_below=0.3), np.full(12, 0.2))
    assert found.new_height[[2, 5]].tolist() == [0.0, 0.0]


def test_single_point_goes_to_the_plane():
    found = new_heights(np.array([[0, 0, 9.0]]), np.zeros(1), np.array(["attach"]), np.array([0.2]))
    assert found.new_height.tolist() == [0.0]


def test_smaller_beta_lets_points_stand_further_out():
    points = _points(40)
    rho = relative_differentials(
        differentials(points[:, 2], nearest_neighbours(points[:, :2], symmetric=False))
    )
    action = actions(rho, discard_above=1.0, attach_below=0.1)
    height = [np.nanmean(new_heights(points, rho, action, np.full(40, b)).new_height) for b in (0.05, 0.8)]
    assert height[0] > 2 * height[1]
