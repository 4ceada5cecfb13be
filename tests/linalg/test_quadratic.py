import numpy as np
import pytest
import scipy.optimize
import scipy.sparse as sp

from o3d_relief.linalg.quadratic import minimise


def test_without_inequalities_that_bind_it_is_a_linear_system():
    form, pull = np.array([[4.0, 1.0], [1.0, 3.0]]), np.array([1.0, 2.0])
    found = minimise(sp.csr_array(form), pull, sp.csr_array(np.eye(2)), np.full(2, -9.0))
    assert found == pytest.approx(np.linalg.solve(form, pull), abs=1e-5)


def test_agrees_with_another_method():
    rng = np.random.default_rng(0)
    root = rng.normal(size=(6, 6))
    form, pull, rows, least = (
        root @ root.T + np.eye(6),
        rng.normal(size=6),
        rng.normal(size=(9, 6)),
        np.full(9, -0.2),
    )
    found = minimise(sp.csr_array(form), pull, sp.csr_array(rows), least)
    reference = scipy.optimize.minimize(
        lambda x: x @ form @ x / 2 - pull @ x,
        np.zeros(6),
        jac=lambda x: form @ x - pull,
        constraints=scipy.optimize.LinearConstraint(rows, least, np.inf),
        method="trust-constr",
        options={"gtol": 1e-10, "xtol": 1e-12, "maxiter": 5000},
    )
    assert found == pytest.approx(reference.x, abs=1e-4)
    assert (rows @ found >= least - 1e-5).all()
    assert (rows @ found < least + 1e-4).any()


def test_none_where_nothing_fulfils_all():
    rows = sp.csr_array([[1.0, 0.0], [-1.0, 0.0]])
    assert minimise(sp.csr_array(np.eye(2)), np.zeros(2), rows, np.array([1.0, 1.0])) is None
