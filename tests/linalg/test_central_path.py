import numpy as np
import pytest
import scipy.sparse as sp

from o3d_relief.linalg.central_path import CentralPath


def path_in_a_box(pull=(3.0, 0.0), *, upper=2.0):
    pull = np.array(pull)
    return CentralPath(
        sp.csr_array(np.eye(2)),
        pull,
        np.zeros(2),
        np.array([0.5, 0.5]),
        np.full(2, -2.0),
        np.full(2, upper),
        sp.csr_array((0, 2)),
        np.zeros(0),
    )


def test_steps_close_the_gap_and_stay_inside():
    path = path_in_a_box()
    gaps = []
    for _ in range(8):
        path.advance(0.0)
        gaps.append(path.gap())
        assert (np.abs(path.x) < 2.0).all()
    assert gaps[-1] < 1e-3 * gaps[0]
    assert path.x == pytest.approx([2.0, 0.0], abs=1e-3)
    assert path.least() == pytest.approx(-4.0, abs=1e-3)


def test_no_gap_below_the_least_is_aimed_at():
    path = path_in_a_box()
    for _ in range(12):
        path.advance(0.01)
    assert path.gap() == pytest.approx(0.01, rel=0.05)


def test_rows_that_are_broken_when_they_come_hold_in_the_end():
    path = path_in_a_box()
    for _ in range(4):
        path.advance(0.0)
    row = sp.csr_array(np.array([[-1.0, 0.0]]))
    path.add(row, np.array([-1.0]))
    assert path.lacking.tolist() == [True]
    for _ in range(10):
        path.advance(1e-4)
    assert not path.lacking.any()
    assert path.x == pytest.approx([1.0, 0.0], abs=1e-2)
    assert path.least() == pytest.approx(-2.5, abs=1e-2)


def test_rows_that_are_known_are_not_added_again():
    path = path_in_a_box()
    row = sp.csr_array(np.array([[-1.0, 0.0]]))
    path.add(row, np.array([-1.0]))
    path.add(row, np.array([-1.0]))
    assert path.rows.shape[0] == 1
