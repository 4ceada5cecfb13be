"""Quadratic forms under linear inequalities."""

from __future__ import annotations

import clarabel
import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

__all__ = ["minimise"]

_FEASIBLE = 1e-6
"""Accuracy of the inequalities, at least."""

_REFINED = 1e-4
"""From here on each step is refined iteratively, which takes as long again."""

_ITERATIONS = 80
"""A programme that can be fulfilled takes 20 to 60; the rest are mostly those that cannot."""

_MISSED = 1e-3
"""By how much inequalities may be missed: "almost solved" can be far off."""

_FOUND = (clarabel.SolverStatus.Solved, clarabel.SolverStatus.AlmostSolved)


def minimise(
    form: sp.csr_array,
    pull: NDArray[np.float64],
    rows: sp.csr_array,
    least: NDArray[np.float64],
    *,
    tolerance: float = 1e-8,
) -> NDArray[np.float64] | None:
    """Minimise a quadratic form subject to linear inequalities.

    minimise  1/2 x' A x - b' x   subject to   G x >= h

    by the interior point method of Clarabel, whose steps are sparse factorisations on one thread: the
    result does not depend on the number of threads.

    Parameters
    ----------
    form : (n, n) sparse float64
        A, symmetric positive definite.
    pull : (n,) float64
        b.
    rows : (m, n) sparse float64
        G.
    least : (m,) float64
        h.
    tolerance : float
        Share by which the form may lie above its minimum.

    Returns
    -------
    (n,) float64 or None
        None where no x fulfils all inequalities, or none was found. They hold up to 1e-3, most to 1e-6.

    Examples
    --------
    The point nearest to the origin with x + y >= 2:

    >>> one = sp.csr_array(np.eye(2))
    >>> minimise(one, np.zeros(2), sp.csr_array([[1.0, 1.0]]), np.array([2.0])).round(6).tolist()
    [1.0, 1.0]
    """
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.max_iter = _ITERATIONS
    settings.direct_solve_method = "qdldl"
    feasible = min(tolerance, _FEASIBLE)
    settings.tol_gap_rel, settings.tol_gap_abs, settings.tol_feas = tolerance, feasible, feasible
    settings.iterative_refinement_enable = tolerance < _REFINED
    solver = clarabel.DefaultSolver(
        _columns(sp.triu(form)),
        -pull,
        _columns(-rows),
        -least,
        [clarabel.NonnegativeConeT(len(least))],
        settings,
    )
    solution = solver.solve()
    found = np.array(solution.x, dtype=np.float64)
    if solution.status not in _FOUND or (len(least) and (least - rows @ found).max() > _MISSED):
        return None
    return found


def _columns(matrix: sp.sparray) -> sp.csc_matrix:
    """Return a matrix by columns, as Clarabel takes it."""
    return sp.csc_matrix(matrix)
