import numpy as np
import pytest
import scipy.sparse as sp

from o3d_relief import cotangent_laplacian
from o3d_relief.linalg.held import HeldMatrix, HeldMultigrid
from o3d_relief.linalg.multigrid import Multigrid
from o3d_relief.linalg.solve import conjugate_gradients
from shapes import hills


def _matrix(side):
    laplacian, _ = cotangent_laplacian(*hills(side))
    return laplacian[1:][:, 1:].tocsr()


def _moving(n, share, seed=0):
    return np.random.default_rng(seed).random(n) > share


def _dense(cycle, n):
    return np.stack([cycle(unit) for unit in np.eye(n)], axis=1)


def test_held_matrix_is_the_matrix_without_the_rows_and_columns():
    matrix = _matrix(12)
    moving = _moving(matrix.shape[0], 0.3)
    vector = np.where(moving, np.random.default_rng(1).normal(size=len(moving)), 0.0)
    product = HeldMatrix(matrix, moving) @ vector
    assert product[moving] == pytest.approx((matrix.toarray() @ vector)[moving])
    assert not product[~moving].any()


@pytest.mark.parametrize("share", [0.0, 0.02, 0.5, 0.98])
def test_cycle_is_symmetric_close_to_the_inverse_and_leaves_what_is_held(share):
    matrix = _matrix(25)
    n = matrix.shape[0]
    moving = _moving(n, share)
    cycle = HeldMultigrid(matrix)
    cycle.hold(moving)
    inverse = _dense(cycle, n)[moving]
    assert not inverse[:, ~moving].any()
    assert not cycle(np.ones(n))[~moving].any()
    inverse = inverse[:, moving]
    assert inverse == pytest.approx(inverse.T, abs=1e-12 * np.abs(inverse).max())
    shares = np.linalg.eigvals(inverse @ matrix.toarray()[moving][:, moving]).real
    assert 0.1 < shares.min() <= shares.max() < 1.0 + 1e-9


def test_a_few_more_held_hardly_change_the_steps_of_conjugate_gradients():
    matrix = _matrix(60)
    n = matrix.shape[0]
    right = np.random.default_rng(0).normal(size=n)
    cycle = HeldMultigrid(matrix)
    for share in (0.05, 0.052, 0.3, 0.01):
        moving = _moving(n, share)
        cycle.hold(moving)
        inner = matrix[moving][:, moving].tocsr()
        steps = []
        for system, own, cycle_of in (
            (inner, right[moving], Multigrid(inner)),
            (HeldMatrix(matrix, moving), np.where(moving, right, 0.0), cycle),
        ):
            ticks = []
            found, _ = conjugate_gradients(system, own, np.zeros(len(own)), cycle_of, tick=ticks.append)
            assert np.linalg.norm(system @ found - own) <= 1e-9 * np.linalg.norm(own)
            steps.append(len(ticks))
        assert steps[1] <= steps[0] + 4


def test_unconnected_unknowns_are_solved_exactly():
    values = np.linspace(1.0, 9.0, 300)
    cycle = HeldMultigrid(sp.diags_array(values).tocsr())
    moving = _moving(300, 0.4)
    cycle.hold(moving)
    assert cycle(np.ones(300)) == pytest.approx(moving / values)
