import numpy as np
import pytest
import scipy.sparse as sp

from o3d_relief.linalg.near_rows import NearRows, room


def differences(n, p, seed=0):
    """Rows that tell by how much one unknown is above another."""
    rng = np.random.default_rng(seed)
    upper, lower = rng.integers(0, n, (2, p))
    row = np.arange(p)
    ones = np.ones(p)
    entries = np.concatenate([row, row]), np.concatenate([upper, lower])
    return sp.coo_array((np.concatenate([ones, -ones]), entries), shape=(p, n)).tocsr()


def test_no_row_is_overlooked_on_a_long_walk():
    rows, rng = differences(50, 2000), np.random.default_rng(1)
    x = np.zeros(50)
    bound = -rng.exponential(1.0, 2000) - 1e-3
    near = NearRows(rows, bound)
    looked_at = []
    for length in (1.0, 0.5, 0.1, 0.02, 0.01, 0.2, 0.002, 0.001):
        step = length * rng.uniform(-1.0, 1.0, 50)
        slack, moves = rows @ x - bound, rows @ step
        whole = room(slack, moves)
        reach = near.reach(x, step, 1.6)
        looked_at.append(len(reach))
        assert np.sort(reach[reach < 1.6]) == pytest.approx(np.sort(whole[whole < 1.6]), rel=1e-9)
        share = min(1.0, 0.9 * whole.min())
        near.moved(share, step)
        x = x + share * step
    assert looked_at[-1] < 0.1 * 2000 < looked_at[0]


def test_rows_that_are_taken_do_not_come_again():
    rows, step = differences(20, 100), np.linspace(-1.0, 1.0, 20)
    near = NearRows(rows, np.full(100, -0.5))
    reach = near.reach(np.zeros(20), step, 1.0)
    chosen = reach < 1.0
    taken, bound = near.take(chosen)
    assert taken.shape[0] == len(bound) == chosen.sum() > 0
    assert (0.5 + taken @ step < 0.0).all()
    for times in (1.0, 1e-3, 1.0):
        assert near.reach(np.zeros(20), times * step, 1.0).min(initial=np.inf) >= 1.0


def test_without_rows_nothing_is_reached():
    near = NearRows(sp.csr_array((0, 3)), np.zeros(0))
    assert len(near.reach(np.zeros(3), np.ones(3), 1.6)) == 0
    near.moved(1.0, np.ones(3))


def test_room_ends_where_a_value_becomes_zero():
    assert room(np.array([1.0, 1.0, 2.0]), np.array([-2.0, 0.0, 1.0])).tolist() == [0.5, np.inf, np.inf]
