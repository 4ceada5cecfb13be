import numpy as np
import pytest
import scipy.sparse as sp
from scipy.optimize import minimize

from o3d_relief.linalg.interior import minimise


def nothing_more(x):
    return sp.csr_array((0, len(x))), np.zeros(0)


def solve(
    form, pull, start, *, origin=None, lower=None, upper=None, rows=None, bound=None, more_rows=nothing_more
):
    n = len(pull)
    return minimise(
        sp.csr_array(form),
        np.asarray(pull, dtype=float),
        origin=np.zeros(n) if origin is None else np.asarray(origin, dtype=float),
        start=np.asarray(start, dtype=float),
        lower=np.full(n, -np.inf) if lower is None else np.asarray(lower, dtype=float),
        upper=np.full(n, np.inf) if upper is None else np.asarray(upper, dtype=float),
        rows=sp.csr_array((0, n)) if rows is None else sp.csr_array(np.asarray(rows, dtype=float)),
        bound=np.zeros(0) if bound is None else np.asarray(bound, dtype=float),
        accuracy=1e-6,
        more_rows=more_rows,
    )


def test_bounds_of_a_hand_made_problem():
    # min (x - 3)^2 / 2 + (y + 2)^2 / 2 with x <= 1 and y >= -1
    found = solve(np.eye(2), [3, -2], [0.5, 0.5], lower=[-np.inf, -1], upper=[1, np.inf])
    assert found.x == pytest.approx([1.0, -1.0], abs=1e-4)
    assert found.x[0] < 1.0
    assert found.x[1] > -1.0


def test_the_energy_is_that_of_the_way_from_the_origin():
    # min (x - 5)^2 / 2 + (y + 3)^2 / 2 with x <= 1 and y >= -1
    found = solve(np.eye(2), [0, 0], [0.5, 0.5], origin=[5, -3], lower=[-np.inf, -1], upper=[1, np.inf])
    assert found.x == pytest.approx([1.0, -1.0], abs=1e-4)


def test_row_of_a_hand_made_problem():
    # min |x|^2 / 2 - 2 (x_1 + x_2) with x_1 + x_2 <= 2: (1, 1)
    found = solve(np.eye(2), [2, 2], [0.1, -0.3], rows=[[-1, -1]], bound=[-2])
    assert found.x == pytest.approx([1.0, 1.0], abs=1e-4)


def test_free_minimum_needs_no_constraint_to_bind():
    found = solve(np.diag([2.0, 4.0]), [2, 4], [0.1, 0.1], lower=[-9, -9], upper=[9, 9])
    assert found.x == pytest.approx([1.0, 1.0], abs=1e-3)


@pytest.mark.parametrize("seed", range(5))
def test_random_programs_agree_with_another_solver(seed):
    rng = np.random.default_rng(seed)
    n, p = 6, 8
    half = rng.normal(size=(n, n))
    form, pull = half @ half.T + 0.1 * np.eye(n), 5 * rng.normal(size=n)
    rows, start = rng.normal(size=(p, n)), 0.1 * rng.normal(size=n)
    bound = rows @ start - rng.uniform(0.1, 1.0, p)
    lower, upper = start - rng.uniform(0.1, 2.0, n), start + rng.uniform(0.1, 2.0, n)
    found = solve(form, pull, start, lower=lower, upper=upper, rows=rows, bound=bound)
    other = minimize(
        lambda x: x @ form @ x / 2 - pull @ x,
        start,
        jac=lambda x: form @ x - pull,
        bounds=list(zip(lower, upper, strict=True)),
        constraints={"type": "ineq", "fun": lambda x: rows @ x - bound, "jac": lambda x: rows},
        method="SLSQP",
        options={"ftol": 1e-12, "maxiter": 300},
    )
    value = found.x @ form @ found.x / 2 - pull @ found.x
    assert value == pytest.approx(other.fun, abs=1e-3 * (1 + abs(other.fun)))
    assert (rows @ found.x > bound).all()
    assert ((found.x > lower) & (found.x < upper)).all()


def test_rows_that_come_later_are_kept_and_only_what_was_accepted_is_returned():
    row = sp.csr_array(np.array([[-1.0, 0.0]]))
    asked = []

    def half_way(x):
        asked.append(x[0] < 1.0)
        return nothing_more(x) if x[0] < 1.0 else (row, np.array([-1.0]))

    found = solve(np.eye(2), [3, 0], [0.0, 0.5], upper=[2, 2], lower=[-2, -2], more_rows=half_way)
    assert not all(asked)
    assert asked[-1]
    assert found.x[0] < 1.0
    assert found.x == pytest.approx([1.0, 0.0], abs=0.05)


@pytest.mark.parametrize("seed", range(3))
def test_it_does_not_matter_when_rows_come(seed):
    rng = np.random.default_rng(seed)
    n, p = 8, 12
    half = rng.normal(size=(n, n))
    form, pull = half @ half.T + 0.1 * np.eye(n), 5 * rng.normal(size=n)
    rows, start = rng.normal(size=(p, n)), 0.1 * rng.normal(size=n)
    bound = rows @ start - rng.uniform(0.1, 1.0, p)

    def broken(x):
        late = np.flatnonzero(rows @ x <= bound)
        return sp.csr_array(rows[late]), bound[late]

    box = {"lower": np.full(n, -9.0), "upper": np.full(n, 9.0)}
    known = solve(form, pull, start, rows=rows, bound=bound, **box)
    late = solve(form, pull, start, more_rows=broken, **box)
    assert (rows @ late.x > bound).all()
    assert late.x == pytest.approx(known.x, abs=1e-3)


def test_the_gap_is_that_of_what_is_returned():
    row = sp.csr_array(np.array([[-1.0, 0.0]]))
    found = solve(
        np.eye(2),
        [3, 0],
        [0.5, 0.0],
        upper=[2, 2],
        lower=[-2, -2],
        more_rows=lambda _x: (row, np.array([-1.0])),  # nothing is ever accepted
    )
    assert found.x == pytest.approx([0.5, 0.0])
    # The objective is -1.375 there, and at least -2.5 where x <= 1; the energy there is 0.125.
    assert found.gap == pytest.approx((2.5 - 1.375) / 0.125, rel=0.02)
