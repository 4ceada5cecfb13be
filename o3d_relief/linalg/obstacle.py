"""Quadratic forms with a lower bound for each unknown: obstacle problems."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from o3d_relief.linalg.held import HeldMatrix, HeldMultigrid
from o3d_relief.linalg.one_thread import one_thread
from o3d_relief.linalg.solve import FACTORISED_UP_TO, conjugate_gradients, solve_spd
from o3d_relief.progress import Tick, silent

__all__ = ["Above", "minimise_above"]

_BELOW = 1e-6
"""By how much an unknown may lie below its bound and count as on it; the result is set onto it."""

_FEW = 500
"""Unknowns up to which every round is solved exactly."""

_STEPS = 4
"""Steps of conjugate gradients in each round while the unknowns on their bounds are still being found."""

_ROUGH = 12
"""Rounds from which on all are solved exactly: where most unknowns end on bounds, a few steps may not do."""

_LOWEST_FIRST = 3
"""Rounds in which only what is lowest around is held: at first, all that is below is far too much."""

_ROUNDS = 40


@dataclass(frozen=True, kw_only=True, eq=False)
class Above:
    """The minimum of a quadratic form above bounds.

    Attributes
    ----------
    x : (n,) float64
    on_bound : (n,) bool
        Unknowns that lie on their bounds.
    rounds : int
        Linear systems solved.
    """

    x: NDArray[np.float64]
    on_bound: NDArray[np.bool_]
    rounds: int


def minimise_above(
    matrix: sp.csr_array,
    pull: NDArray[np.float64],
    lowest: NDArray[np.float64],
    *,
    similar: sp.csr_array,
    error: float,
    tick: Tick = silent,
) -> Above:
    """Minimise a quadratic form with a lower bound for each unknown.

    minimise  1/2 x' A x - b' x   subject to   x >= lowest

    by a primal-dual active set: what came to lie below its bound is held on it, what is pulled towards its
    bound, not held off it, is let go. While the set is being found, a few steps of conjugate gradients take
    the place of each solution, on one multigrid hierarchy for all rounds; the last ones are exact.

    Parameters
    ----------
    matrix : (n, n) sparse float64
        A, symmetric positive definite.
    pull : (n,) float64
        b.
    lowest : (n,) float64
        Minus infinity for no bound.
    similar : (n, n) sparse float64
        A second-order operator with the pattern of a mesh that is spectrally close to A, with its diagonal.
    error : float
        Energy norm of the error to which the last systems are solved.
    tick : callable, optional
        Called in every step of the linear solver; it may raise to end the work.

    Returns
    -------
    Above

    Raises
    ------
    SolverError
        A linear system could not be solved to its tolerance.

    Examples
    --------
    >>> one = sp.csr_array(np.eye(2))
    >>> minimise_above(one, np.array([1.0, 3.0]), np.array([2.0, 2.0]), similar=one, error=1e-6).x.tolist()
    [2.0, 3.0]
    """
    n = len(pull)
    if not np.isfinite(lowest).any():
        x = solve_spd(matrix, pull, similar=similar, error=error, tick=tick)
        return Above(x=x, on_bound=np.zeros(n, dtype=bool), rounds=1)
    with one_thread():
        solver = _Rounds(matrix, pull, similar, error, tick)
        x, held, rounds, exact = np.zeros(n), np.zeros(n, dtype=bool), 0, n <= _FEW
        while True:
            x = solver.solve(np.where(held, lowest, 0.0), held, x, exact=exact)
            rounds += 1
            below = ~held & (x < lowest - _BELOW)
            released = held & (matrix @ x < pull)
            if rounds <= _LOWEST_FIRST:
                # Most of what is below comes up with the lowest ones.
                below = _lowest_around(similar, np.where(below, lowest - x, 0.0))
            if rounds > _ROUNDS:
                # The active set goes round in a circle: from here on it only grows, and so comes to an end.
                released[:] = False
            done = not below.any() and not released.any()
            if done and exact:
                break
            exact |= done or rounds >= _ROUGH
            held = (held & ~released) | below
    return Above(x=np.maximum(x, lowest), on_bound=held, rounds=rounds)


class _Rounds:
    """The systems with some unknowns held."""

    def __init__(
        self,
        matrix: sp.csr_array,
        pull: NDArray[np.float64],
        similar: sp.csr_array,
        error: float,
        tick: Tick,
    ) -> None:
        self._matrix, self._pull, self._error, self._tick = matrix, pull, error, tick
        self._cycle = HeldMultigrid(similar) if len(pull) > _FEW else None

    def solve(
        self, at: NDArray[np.float64], held: NDArray[np.bool_], start: NDArray[np.float64], *, exact: bool
    ) -> NDArray[np.float64]:
        """Solve for what is not held; what is held stays at `at`."""
        moving = ~held
        right = np.where(moving, self._pull - self._matrix @ at, 0.0)
        start = np.where(moving, start, 0.0)
        if self._cycle is not None:
            self._cycle.hold(moving)
        if exact or self._cycle is None:
            found = solve_spd(
                _holding(self._matrix, moving),
                right,
                cycle=self._cycle if len(at) > FACTORISED_UP_TO else None,
                error=self._error,
                start=start,
                tick=self._tick,
            )
        else:
            held_matrix = HeldMatrix(self._matrix, moving)
            found, _ = conjugate_gradients(
                held_matrix, right, start, self._cycle, steps=_STEPS, error=self._error, tick=self._tick
            )
        return np.where(moving, found, at)


def _lowest_around(matrix: sp.csr_array, lacking: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Find the unknowns that lack something, and more than all next to them, (n,)."""
    most = np.maximum.reduceat(np.append(lacking[matrix.indices], 0.0), matrix.indptr[:-1])
    return np.asarray((lacking > 0.0) & (lacking >= most))


def _holding(matrix: sp.csr_array, moving: NDArray[np.bool_]) -> sp.csr_array:
    """Return a matrix of which the rows and columns that do not move have their diagonal left alone."""
    if moving.all():
        return matrix
    row = np.repeat(np.arange(len(moving)), np.diff(matrix.indptr))
    stays = (moving[row] & moving[matrix.indices]) | (row == matrix.indices)
    count = np.concatenate([[0], np.cumsum(stays)])
    parts = matrix.data[stays], matrix.indices[stays], count[matrix.indptr]
    return sp.csr_array(parts, shape=matrix.shape)
