import numpy as np
import pytest
import scipy.sparse as sp
from scipy.optimize import lsq_linear

from o3d_relief.linalg.box import box_minimum


@pytest.mark.parametrize("seed", range(8))
def test_it_is_the_least_squares_solution_between_the_bounds(seed):
    rng = np.random.default_rng(seed)
    rows, pull = rng.normal(size=(40, 25)), rng.normal(size=40) * 3.0
    upper = rng.uniform(0.05, 1.0, 25)
    found = box_minimum(sp.csr_array(rows.T @ rows), rows.T @ pull, upper)
    expected = lsq_linear(rows, pull, (0.0, upper), method="bvls", tol=1e-14).x
    assert found == pytest.approx(expected, abs=1e-9)
    assert ((found == 0.0).any(), (found == upper).any()) == (True, True)


def test_an_active_set_that_goes_round_in_circles_is_left():
    # The whole set is exchanged back and forth here, so that single exchanges are needed.
    form = np.array([[8.0, -8.0, -8.0], [-8.0, 14.0, 16.0], [-8.0, 16.0, 19.0]])
    pull = np.array([4.0, -3.0, -1.0])
    found = box_minimum(sp.csr_array(form), -pull, np.full(3, 1e3))
    gradient = form @ found + pull
    assert (found >= 0.0).all()
    assert (gradient >= -1e-9).all()
    assert found @ gradient == pytest.approx(0.0, abs=1e-9)
