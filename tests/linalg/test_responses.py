import numpy as np
import pytest
import scipy.sparse as sp

from o3d_relief import cotangent_laplacian
from o3d_relief.linalg.responses import Responses
from shapes import hills


def _chain(n):
    """A chain of n vertices with springs of 1 between neighbours."""
    rows = sp.diags_array([-np.ones(n - 1), np.ones(n - 1)], offsets=[0, 1], shape=(n - 1, n))
    positions = np.zeros((n, 3))
    positions[:, 0] = np.arange(n)
    return (rows.T @ rows).tocsr(), positions


def _free(n, index):
    free = np.ones(n, dtype=bool)
    free[index] = False
    return free


def _solved(form, index, values, released, pull):
    """The same system, dense, with the points that are held."""
    held = index[~released]
    free = np.setdiff1d(np.arange(form.shape[0]), held)
    dense = form.toarray()
    result = np.zeros(form.shape[0])
    result[held] = values[~released]
    result[free] = np.linalg.solve(dense[np.ix_(free, free)], pull[free] - dense[free] @ result)
    return result


def test_a_chain_is_linear_between_its_points():
    form, positions = _chain(9)
    index = np.array([0, 4, 8])
    responses = Responses(form, positions, index, _free(9, index))
    moved = np.array([0.0, 8.0, 4.0])
    none = np.zeros(3, dtype=bool)
    assert responses.displacement(moved, none) == pytest.approx(np.array([0, 2, 4, 6, 8, 7, 6, 5, 4.0]))
    released = np.array([False, True, False])
    expected = np.arange(9) / 2.0
    assert responses.displacement(moved, released) == pytest.approx(expected, abs=1e-5)
    assert moved[1] == 8.0  # the input stays as it is


def test_the_weights_are_an_average():
    vertices, faces = hills(41)
    laplacian, _ = cotangent_laplacian(vertices, faces)
    index = np.array([3, 700, 1200, 1600])
    responses = Responses(laplacian, vertices, index, _free(len(vertices), index))
    assert responses.displacement(np.full(4, 7.0), np.zeros(4, dtype=bool)) == pytest.approx(7.0, abs=1e-5)


@pytest.mark.parametrize("count", [1, 5, 70])
def test_any_release_equals_the_solution_without_the_points(count):
    vertices, faces = hills(31)
    laplacian, _ = cotangent_laplacian(vertices, faces)
    n = len(vertices)
    rng = np.random.default_rng(count)
    index = rng.choice(n, size=count, replace=False)
    responses = Responses(laplacian, vertices, index, _free(n, index), keep_factor=True)
    for share in (0.0, 0.5, 0.9):
        released = rng.random(count) < share
        released[0] = False
        moved = rng.uniform(-50, 50, size=count)
        pull = rng.normal(size=n)
        expected = _solved(laplacian, index, moved, released, pull)
        assert responses.displacement(moved, released, pull) == pytest.approx(expected, abs=1e-4)
        expected = _solved(laplacian, index, moved, released, np.zeros(n))
        assert responses.displacement(moved, released) == pytest.approx(expected, abs=2e-5)


def test_what_is_not_free_does_not_move():
    form, positions = _chain(9)
    free = _free(9, [4])
    free[5:] = False
    responses = Responses(form, positions, np.array([4]), free)
    expected = [2.0] * 5 + [0.0] * 4
    assert responses.displacement(np.array([2.0]), np.array([False])).tolist() == expected
