"""One way to solve the sparse symmetric positive definite systems of the method."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sla
from numpy.typing import NDArray

from o3d_relief.errors import SolverError
from o3d_relief.linalg.factor import Factor
from o3d_relief.linalg.multigrid import Multigrid, multigrid
from o3d_relief.linalg.one_thread import one_thread
from o3d_relief.progress import Tick, silent

__all__ = ["FACTORISED_UP_TO", "conjugate_gradients", "multigrid", "solve_direct", "solve_spd"]

FACTORISED_UP_TO = 4000
"""Unknowns up to which any system is factorised."""

_MAX_ITERATIONS = 1000

_LOOK_BACK = 6
"""Steps of the iteration from which is estimated what is left."""

_GOOD_ENOUGH = 1e-8
"""Relative residual above which a solution is refused."""


def solve_spd(
    matrix: sp.csr_array,
    right_hand_side: NDArray[np.float64],
    *,
    similar: sp.csr_array | None = None,
    cycle: Callable[[NDArray[np.float64]], NDArray[np.float64]] | None = None,
    direct_up_to: int = FACTORISED_UP_TO,
    tolerance: float = 1e-12,
    error: float = 0.0,
    start: NDArray[np.float64] | None = None,
    tick: Tick = silent,
) -> NDArray[np.float64]:
    """Solve A x = b for a sparse symmetric positive definite A.

    Up to 4,000 unknowns by a sparse factorisation, above by conjugate gradients, preconditioned with smoothed
    aggregation multigrid, whose cost and memory grow linearly. The result does not depend on the number
    of threads: sums are taken on one.

    Parameters
    ----------
    matrix : (n, n) sparse float64
    right_hand_side : (n,) float64
    similar : (n, n) sparse float64, optional
        A second-order operator that is spectrally close to `matrix`, to build the multigrid on;
        `matrix` itself where omitted.
    cycle : callable, optional
        A preconditioner that is at hand already, in place of a new multigrid.
    direct_up_to : int
        Unknowns up to which the matrix is factorised; systems of many small bodies have sparse factors.
    tolerance : float
        Norm of the residual relative to that of `right_hand_side` at which the iteration stops.
    error : float
        Energy norm of the error, sqrt(e' A e), at which it stops, too, as far as that can be estimated.
    start : (n,) float64, optional
        Where the iteration starts; zero where omitted.
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
    left = np.inf
    with one_thread():
        if n <= direct_up_to:
            solution = Factor(matrix, None).solve(right_hand_side)
        else:
            cycle = Multigrid(matrix if similar is None else similar) if cycle is None else cycle
            start = np.zeros(n) if start is None else start
            solution, left = conjugate_gradients(
                matrix, right_hand_side, start, cycle, tolerance=tolerance, error=error, tick=tick
            )
        residual = np.linalg.norm(matrix @ solution - right_hand_side)
        reached = float(residual / np.linalg.norm(right_hand_side))
    if left <= error**2:
        return solution
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


class _Matrix(Protocol):
    """Anything that is multiplied by a vector."""

    def __matmul__(self, vector: NDArray[np.float64], /) -> NDArray[np.float64]: ...


def conjugate_gradients(
    matrix: _Matrix | sp.csr_array,
    right_hand_side: NDArray[np.float64],
    start: NDArray[np.float64],
    precondition: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    *,
    steps: int = _MAX_ITERATIONS,
    tolerance: float = 1e-12,
    error: float = 0.0,
    tick: Tick = silent,
) -> tuple[NDArray[np.float64], float]:
    """Iterate until the residual or the error is small enough, or for so many steps.

    Parameters
    ----------
    matrix : (n, n) symmetric positive definite
        Only its products with vectors are asked for.
    right_hand_side, start : (n,) float64
    precondition : callable
        Symmetric positive definite, too.
    steps : int
    tolerance, error : float
        See `solve_spd`.
    tick : callable, optional

    Returns
    -------
    solution : (n,) float64
    left : float
        An estimate of the squared energy norm of the error.
    """
    solution = start.copy()
    residual = right_hand_side - matrix @ solution
    small = tolerance * float(np.linalg.norm(right_hand_side))
    direction, last = np.zeros(0), 0.0
    gains: list[float] = []
    for _ in range(steps):
        tick(None)
        steepest = precondition(residual)
        now = float(residual @ steepest)
        if gains:
            direction *= now / last
            direction += steepest
        else:
            direction = steepest
        along = matrix @ direction
        curvature = float(direction @ along)
        if not (curvature > 0.0 and now > 0.0):
            break
        step, last = now / curvature, now
        along *= step
        residual -= along
        solution += np.multiply(direction, step, out=along)
        gains.append(step * now)
        if np.linalg.norm(residual) <= small or _energy_left(gains) <= error**2:
            break
    return solution, _energy_left(gains)


def _energy_left(gains: list[float]) -> float:
    """Estimate the squared energy norm of the error from what each step has taken off it.

    The steps to come take off all that is left; they are taken to go on shrinking as the last few have done.
    """
    if len(gains) <= _LOOK_BACK:
        return np.inf
    recent = gains[-_LOOK_BACK:]
    shrinking = (max(recent[_LOOK_BACK // 2 :]) / max(recent[: _LOOK_BACK // 2])) ** (2.0 / _LOOK_BACK)
    return max(recent[_LOOK_BACK // 2 :]) / (1.0 - shrinking) if shrinking < 1.0 else np.inf
