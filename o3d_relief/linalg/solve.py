"""One way to solve the sparse symmetric positive definite systems of the method."""

from __future__ import annotations

import numpy as np
import pyamg
import scipy.sparse as sp
import scipy.sparse.linalg as sla
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from o3d_relief.errors import SolverError
from o3d_relief.progress import Tick, silent

__all__ = ["multigrid", "solve_direct", "solve_spd"]

_DIRECT_UP_TO = 4000
_MAX_ITERATIONS = 1000

_GOOD_ENOUGH = 1e-8
"""Relative residual above which a solution is refused."""


def solve_spd(
    matrix: sp.csr_array,
    right_hand_side: NDArray[np.float64],
    *,
    similar: sp.csr_array | None = None,
    tolerance: float = 1e-12,
    tick: Tick = silent,
) -> NDArray[np.float64]:
    """Solve A x = b for a sparse symmetric positive definite A.

    Up to 4,000 unknowns by a sparse LU, above by conjugate gradients, preconditioned with smoothed
    aggregation multigrid, whose cost and memory grow linearly. The result does not depend on the number
    of threads: sums are taken on one.

    Parameters
    ----------
    matrix : (n, n) sparse float64
    right_hand_side : (n,) float64
    similar : (n, n) sparse float64, optional
        A second-order operator that is spectrally close to `matrix`, to build the multigrid on;
        `matrix` itself where omitted.
    tolerance : float
        Norm of the residual relative to that of `right_hand_side` at which the iteration stops.
    tick : callable, optional
        Called in every step of the iteration; it may raise to end the work.

    Returns
    -------
    (n,) float64

    Raises
    ------
    SolverError
        The matrix is singular, or the relative residual is above 1e-8 and ten times the tolerance.

    Examples
    --------
    >>> solve_spd(sp.csr_array(np.diag([2.0, 4.0])), np.array([2.0, 2.0])).tolist()
    [1.0, 0.5]
    """
    n = len(right_hand_side)
    if n == 0 or not right_hand_side.any():
        return np.zeros(n)
    with threadpool_limits(limits=1):
        if n <= _DIRECT_UP_TO:
            solution = solve_direct(matrix, right_hand_side)
        else:
            similar = matrix if similar is None else similar
            solution = _multigrid(matrix, right_hand_side, similar, tolerance, tick)
        residual = np.linalg.norm(matrix @ solution - right_hand_side)
        reached = float(residual / np.linalg.norm(right_hand_side))
    if not reached <= max(_GOOD_ENOUGH, 10.0 * tolerance):
        raise SolverError(
            f"A linear system of {n} unknowns was solved to {reached:.1e} only, not to {_GOOD_ENOUGH:.0e}; "
            "the mesh is likely broken near very thin triangles: repair or remesh it."
        )
    return np.asarray(solution, dtype=np.float64)


def solve_direct(matrix: sp.csr_array, right_hand_side: NDArray[np.float64]) -> NDArray[np.float64]:
    """Solve A x = b for a sparse A of any condition, by an LU factorisation.

    Parameters
    ----------
    matrix : (n, n) sparse float64
    right_hand_side : (n,) float64

    Returns
    -------
    (n,) float64

    Raises
    ------
    SolverError
        The matrix is singular.
    """
    if len(right_hand_side) == 0:
        return np.zeros(0)
    try:
        factor = sla.splu(matrix.tocsc(), permc_spec="MMD_AT_PLUS_A")
    except RuntimeError as error:  # SuperLU: exactly singular
        raise SolverError(f"A linear system of {len(right_hand_side)} unknowns is singular.") from error
    return np.asarray(factor.solve(right_hand_side), dtype=np.float64)


def _with_small_indices(matrix: sp.csr_array) -> sp.csr_matrix:
    """Return a matrix with 32-bit indices, sorted: pyamg goes wrong with others, in silence."""
    matrix = matrix if matrix.has_sorted_indices else matrix.sorted_indices()
    parts = matrix.data, matrix.indices.astype(np.int32), matrix.indptr.astype(np.int32)
    return sp.csr_matrix(parts, shape=matrix.shape)


def multigrid(matrix: sp.csr_array) -> sla.LinearOperator:
    """Build a preconditioner for a sparse symmetric positive definite matrix.

    Parameters
    ----------
    matrix : (n, n) sparse float64

    Returns
    -------
    LinearOperator
        One V-cycle of smoothed aggregation multigrid.
    """
    # "local" weighting bounds the spectral radius row by row; pyamg's default estimates it from a random
    # vector, which would change the last digits from run to run.
    hierarchy = pyamg.smoothed_aggregation_solver(
        _with_small_indices(matrix),
        strength=None,
        improve_candidates=None,
        smooth=("jacobi", {"weighting": "local"}),
        coarse_solver="splu",
        max_coarse=500,
    )
    return hierarchy.aspreconditioner()


def _multigrid(
    matrix: sp.csr_array,
    right_hand_side: NDArray[np.float64],
    similar: sp.csr_array,
    tolerance: float,
    tick: Tick,
) -> NDArray[np.float64]:
    solution, _ = sla.cg(
        matrix,
        right_hand_side,
        rtol=tolerance,
        atol=0.0,
        maxiter=_MAX_ITERATIONS,
        M=multigrid(similar),
        callback=lambda _solution: tick(None),
    )
    return np.asarray(solution, dtype=np.float64)
