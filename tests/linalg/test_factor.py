import numpy as np
import pytest
import scipy.sparse as sp
from threadpoolctl import threadpool_limits

from o3d_relief import SolverError, cotangent_laplacian
from o3d_relief.linalg.factor import Factor
from shapes import bust, grid, hills, joined, moved


def _system(shape):
    vertices, faces = shape
    laplacian, _ = cotangent_laplacian(vertices, faces)
    return (laplacian + sp.diags_array(np.full(len(vertices), 0.01))).tocsr(), vertices


@pytest.mark.parametrize(
    "shape", [grid(3), hills(41), bust(40), joined(hills(21), moved(hills(21), (0, 0, 30)))]
)
def test_solutions_fulfil_their_systems(shape):
    matrix, positions = _system(shape)
    right = np.random.default_rng(0).normal(size=(len(positions), 3))
    factor = Factor(matrix, positions)
    assert np.abs(matrix @ factor.solve(right[:, 0]) - right[:, 0]).max() < 1e-9
    solved = factor.solve_ordered(right[factor.order])
    assert np.abs(matrix[factor.order][:, factor.order] @ solved - right[factor.order]).max() < 1e-9


def test_what_planes_cut_badly_is_ordered_otherwise():
    # Every vertex is tied to one at the other end.
    matrix, positions = _system(grid(41))
    n = len(positions)
    far = sp.coo_array((np.ones(n), (np.arange(n), np.arange(n)[::-1])), shape=(n, n))
    tied = (matrix + sp.diags_array(np.full(n, 2.0)) - far).tocsr()
    right = np.random.default_rng(0).normal(size=(n, 3))
    factor = Factor(tied, positions)
    assert np.abs(tied @ factor.solve(right[:, 0]) - right[:, 0]).max() < 1e-9
    solved = factor.solve_ordered(right[factor.order])
    assert np.abs(tied[factor.order][:, factor.order] @ solved - right[factor.order]).max() < 1e-9


def test_points_at_one_place_are_no_obstacle():
    positions = np.zeros((500, 3))
    matrix = sp.diags_array(np.arange(1.0, 501.0)).tocsr()
    assert Factor(matrix, positions).solve(np.ones(500)) == pytest.approx(1.0 / np.arange(1.0, 501.0))


def test_same_bytes_whatever_the_number_of_threads():
    matrix, positions = _system(bust(40))
    right = np.random.default_rng(0).normal(size=(len(positions), 40))
    once = Factor(matrix, positions).solve_ordered(right)
    with threadpool_limits(limits=1):
        assert Factor(matrix, positions).solve_ordered(right).tobytes() == once.tobytes()


def test_a_singular_system_is_an_error():
    matrix = sp.diags_array([1.0, 0.0, 1.0]).tocsr()
    with pytest.raises(SolverError, match="3 unknowns is not positive definite"):
        Factor(matrix, np.eye(3))
    with pytest.raises(SolverError, match="3 unknowns is singular"):
        Factor(matrix, None)
