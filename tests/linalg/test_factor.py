import numpy as np
import pytest
import scipy.sparse as sp
import scipy.sparse.linalg as sla
from threadpoolctl import threadpool_limits

from o3d_relief import SolverError, cotangent_laplacian
from o3d_relief.linalg.factor import Factor, nested_dissection
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


def test_every_unknown_has_one_place():
    matrix, positions = _system(bust(40))
    assert (np.sort(nested_dissection(positions, matrix)[0]) == np.arange(len(positions))).all()


def test_the_last_unknowns_separate_the_others():
    matrix, positions = _system(hills(41))
    order = nested_dissection(positions, matrix)[0]
    # The first plane leaves two halves; they meet only in a row of 41 vertices or so, which come last.
    rest = np.sort(order[:-45])
    parts, label = sp.csgraph.connected_components(matrix[rest][:, rest], directed=False)
    assert parts >= 2
    assert np.sort(np.bincount(label))[-2:].sum() > 0.95 * len(rest)
    assert np.sort(np.bincount(label))[-2] > 0.4 * len(rest)


def test_a_factor_stays_sparse():
    matrix, positions = _system(hills(81))
    order = nested_dissection(positions, matrix)[0]
    entries = []
    for chosen in (order, np.random.default_rng(0).permutation(len(positions))):
        ordered = matrix[chosen][:, chosen].tocsc()
        entries.append(sla.splu(ordered, permc_spec="NATURAL", diag_pivot_thresh=0.0).nnz)
    assert entries[0] < 0.2 * entries[1]
    n = len(positions)
    assert entries[0] < 10 * n * np.log2(n)


def test_what_planes_cut_badly_is_ordered_otherwise():
    # Every vertex is tied to one at the other end.
    matrix, positions = _system(grid(41))
    n = len(positions)
    far = sp.coo_array((np.ones(n), (np.arange(n), np.arange(n)[::-1])), shape=(n, n))
    tied = (matrix + sp.diags_array(np.full(n, 2.0)) - far).tocsr()
    assert nested_dissection(positions, matrix)[1] < 50.0
    assert nested_dissection(positions, tied)[1] > 50.0
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
    with pytest.raises(SolverError, match="3 unknowns is singular"):
        Factor(sp.diags_array([1.0, 0.0, 1.0]).tocsr(), np.eye(3))
