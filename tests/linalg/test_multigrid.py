import numpy as np
import pytest
import scipy.sparse as sp
from threadpoolctl import threadpool_limits

from o3d_relief import cotangent_laplacian
from o3d_relief.linalg.multigrid import Multigrid, multigrid
from o3d_relief.linalg.solve import solve_spd
from shapes import grid, hills


def _matrix(side):
    laplacian, _ = cotangent_laplacian(*hills(side))
    return laplacian[1:][:, 1:].tocsr()


def _dense(cycle, n):
    return np.stack([cycle(unit) for unit in np.eye(n)], axis=1)


def test_one_cycle_is_symmetric_and_close_to_the_inverse():
    matrix = _matrix(25)
    n = matrix.shape[0]
    inverse = _dense(Multigrid(matrix), n)
    assert inverse == pytest.approx(inverse.T, abs=1e-12 * np.abs(inverse).max())
    # The eigenvalues of M A lie in (0, 1]: the error shrinks in every cycle.
    shares = np.linalg.eigvals(inverse @ matrix.toarray()).real
    assert 0.1 < shares.min() <= shares.max() < 1.0 + 1e-9


@pytest.mark.parametrize(("shear", "most"), [(0.0, 18), (1.5, 28), (3.0, 50)])
def test_obtuse_triangles_cost_few_steps_more(shear, most):
    vertices, faces = grid(121)
    vertices = vertices.copy()
    vertices[:, 0] += shear * vertices[:, 1]
    laplacian, _ = cotangent_laplacian(vertices, faces)
    matrix = laplacian[1:][:, 1:].tocsr()
    steps = []
    solve_spd(
        matrix, np.random.default_rng(0).normal(size=matrix.shape[0]), tolerance=1e-10, tick=steps.append
    )
    assert len(steps) <= most  # 15, 39 and 95 where couplings across obtuse angles count as strong


def test_coarsest_level_is_exact():
    matrix = _matrix(10)
    assert _dense(Multigrid(matrix), 99) @ matrix.toarray() == pytest.approx(np.eye(99), abs=1e-9)


def test_unconnected_unknowns_are_solved_exactly():
    values = np.linspace(1.0, 9.0, 300)
    assert Multigrid(sp.diags_array(values).tocsr())(np.ones(300)) == pytest.approx(1.0 / values)


def test_order_of_the_entries_and_width_of_the_indices_do_not_matter():
    matrix = _matrix(40)
    right = np.random.default_rng(0).normal(size=matrix.shape[0])
    row = np.repeat(np.arange(len(right)), np.diff(matrix.indptr))
    order = np.lexsort((-matrix.indices, row))
    shuffled = sp.csr_array(
        (matrix.data[order], matrix.indices[order].astype(np.int64), matrix.indptr.astype(np.int64)),
        shape=matrix.shape,
    )
    assert not shuffled.has_sorted_indices
    assert Multigrid(shuffled)(right).tobytes() == Multigrid(matrix)(right).tobytes()


def test_same_bytes_whatever_the_number_of_threads():
    matrix = _matrix(60)
    right = np.random.default_rng(0).normal(size=matrix.shape[0])
    with threadpool_limits(limits=1):
        once = Multigrid(matrix)(right)
        assert (multigrid(matrix) @ right).tobytes() == once.tobytes()
