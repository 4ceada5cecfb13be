import numpy as np
import pytest
import scipy.sparse as sp

from o3d_relief import SolverError, cotangent_laplacian
from o3d_relief.linalg.cholesky import Cholesky
from o3d_relief.linalg.dissection import Dissection, nested_dissection
from shapes import bust, hills, joined, moved


def _dissected(starts):
    return Dissection(order=np.arange(starts[-1]), starts=np.array(starts), cut=0.0)


@pytest.mark.parametrize("starts", [[0, 7], [0, 1, 2, 3, 4, 5, 6, 7], [0, 2, 3, 5, 7]])
def test_equal_to_the_dense_solution_whatever_the_blocks(starts):
    rng = np.random.default_rng(0)
    root = rng.normal(size=(7, 7))
    matrix = root @ root.T + np.eye(7)
    right = rng.normal(size=(7, 3))
    factor = Cholesky(sp.csr_array(matrix), _dissected(starts))
    assert factor.solve(right) == pytest.approx(np.linalg.solve(matrix, right))
    assert factor.solve(right[:, 0]) == pytest.approx(np.linalg.solve(matrix, right[:, 0]))


def test_a_chain_by_hand():
    # 2 x_0 - x_1 = 1, -x_0 + 2 x_1 - x_2 = 0, -x_1 + 2 x_2 = 1: all of them are 1.
    matrix = sp.csr_array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 2.0]])
    factor = Cholesky(matrix, Dissection(order=np.array([0, 2, 1]), starts=np.array([0, 1, 2, 3]), cut=0.0))
    assert factor.solve(np.array([1.0, 1.0, 0.0])) == pytest.approx(1.0)


@pytest.mark.parametrize("shape", [hills(41), bust(40), joined(hills(21), moved(hills(21), (0, 0, 30)))])
def test_dissected_meshes(shape):
    vertices, faces = shape
    laplacian, _ = cotangent_laplacian(vertices, faces)
    matrix = (laplacian + sp.diags_array(np.full(len(vertices), 0.01))).tocsr()
    dissection = nested_dissection(vertices, matrix)
    factor = Cholesky(matrix, dissection)
    ordered = matrix[dissection.order][:, dissection.order]
    right = np.random.default_rng(0).normal(size=(len(vertices), 5))
    assert np.abs(ordered @ factor.solve(right) - right).max() < 1e-9
    few = np.zeros((len(vertices), 2))  # most blocks are passed over
    few[3, 0] = few[-1, 1] = 1.0
    assert np.abs(ordered @ factor.solve(few) - few).max() < 1e-9


def test_right_hand_sides_are_overwritten_only_where_that_is_asked_for():
    factor = Cholesky(sp.diags_array(np.full(4, 4.0)).tocsr(), _dissected([0, 2, 4]))
    right = np.ones((4, 2))
    assert (factor.solve(right) == 0.25).all()
    assert (right == 1.0).all()
    assert factor.solve(right, overwrite=True) is right
    assert (right == 0.25).all()


def test_entries_that_are_listed_twice_are_added():
    twice = sp.csr_array(([3.0, 1.0, 4.0], [0, 0, 1], [0, 2, 3]), shape=(2, 2))
    assert Cholesky(twice, _dissected([0, 2])).solve(np.array([8.0, 4.0])).tolist() == [2.0, 1.0]


def test_no_unknowns():
    assert Cholesky(sp.csr_array((0, 0)), _dissected([0])).solve(np.zeros((0, 2))).shape == (0, 2)


def test_a_matrix_that_is_not_positive_definite_is_an_error():
    with pytest.raises(SolverError, match="2 unknowns is not positive definite"):
        Cholesky(sp.csr_array([[1.0, 2.0], [2.0, 1.0]]), _dissected([0, 2]))
    with pytest.raises(SolverError, match="3 unknowns is not positive definite"):
        Cholesky(sp.diags_array([1.0, 0.0, 1.0]).tocsr(), _dissected([0, 1, 3]))
