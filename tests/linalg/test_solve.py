import numpy as np
import pytest
import scipy.sparse as sp
from threadpoolctl import threadpool_limits

from o3d_relief import SolverError, cotangent_laplacian
from o3d_relief.linalg.solve import solve_spd
from shapes import hills


def _system(side):
    laplacian, _ = cotangent_laplacian(*hills(side))
    matrix = laplacian[1:][:, 1:].tocsr()
    return matrix, np.random.default_rng(0).normal(size=matrix.shape[0])


@pytest.mark.parametrize("side", [20, 90])
def test_small_and_large_systems_are_solved_to_the_tolerance(side):
    matrix, right = _system(side)
    found = solve_spd(matrix, right)
    assert np.linalg.norm(matrix @ found - right) <= 1e-9 * np.linalg.norm(right)


def test_both_ways_agree():
    matrix, right = _system(90)
    # Two copies of one system exceed the size up to which it is solved directly.
    double = sp.block_diag([matrix, matrix]).tocsr()
    found = solve_spd(double, np.tile(right, 2))
    half = sp.linalg.splu(matrix.tocsc()).solve(right)
    assert found == pytest.approx(np.tile(half, 2), abs=1e-6 * np.abs(half).max())


def test_the_order_of_the_entries_does_not_matter():
    matrix, right = _system(90)
    shuffled = (matrix.T @ sp.eye_array(matrix.shape[0], format="csr")[::-1]).tocsr()[:, ::-1].tocsr()
    shuffled.has_sorted_indices = None
    assert not shuffled.has_sorted_indices
    found = solve_spd(matrix, right)
    assert solve_spd(shuffled, right) == pytest.approx(found, abs=1e-9 * np.abs(found).max())


def test_same_bytes_whatever_the_number_of_threads():
    matrix, right = _system(90)
    once = solve_spd(matrix, right)
    with threadpool_limits(limits=1):
        assert solve_spd(matrix, right).tobytes() == once.tobytes()


@pytest.mark.parametrize("error", [1e-2, 1e-4, 1e-6])
def test_iteration_stops_at_the_error_that_is_allowed(error):
    matrix, right = _system(90)
    found = solve_spd(matrix, right, error=error)
    off = found - sp.linalg.splu(matrix.tocsc()).solve(right)
    assert 1e-3 * error < np.sqrt(off @ (matrix @ off)) < error


def test_zero_right_hand_side_and_no_unknowns():
    matrix, right = _system(20)
    assert not solve_spd(matrix, 0 * right).any()
    assert solve_spd(sp.csr_array((0, 0)), np.zeros(0)).shape == (0,)


def test_singular_matrix_is_an_error():
    with pytest.raises(SolverError, match="singular"):
        solve_spd(sp.csr_array(np.array([[1.0, -1], [-1, 1]])), np.array([1.0, 1.0]))


def test_system_without_a_solution_is_an_error():
    laplacian, _ = cotangent_laplacian(*hills(90))
    # The rows of the whole Laplacian add up to zero, those of the right-hand side do not.
    with pytest.raises(SolverError, match="was solved to"):
        solve_spd(laplacian, np.ones(laplacian.shape[0]))
