"""Rough solutions of sparse symmetric positive definite systems, several for each matrix."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sla
from numpy.typing import NDArray

from o3d_relief.linalg.factor import Factor
from o3d_relief.linalg.multigrid import Multigrid
from o3d_relief.progress import Tick

__all__ = ["RoughSolver", "Solve"]

_DIRECT_UP_TO = 30_000
"""Unknowns up to which a factor takes less time than a few iterations."""

_TOLERANCE = 1e-2
_MOST_STEPS = 60

Solve = Callable[[NDArray[np.float64]], NDArray[np.float64]]


class RoughSolver:
    """Prepares matrices of one kind.

    Few unknowns are solved for by a sparse factor, many by conjugate gradients with a V-cycle of multigrid
    to a residual of 1e-2, in time and memory that grow linearly. Where that takes too many steps, since stiff
    springs tie what the mesh does not, this and all later matrices are factorised.

    Parameters
    ----------
    tick : callable
        Called in every step of the iteration; it may raise to end the work.
    positions : (n, 3) float64 or None
        See `Factor`.
    """

    def __init__(self, tick: Tick, positions: NDArray[np.float64] | None = None) -> None:
        self._tick, self._positions = tick, positions
        self._directly = False

    def prepare(self, matrix: sp.csr_array) -> Solve:
        """Return what solves A x = b for a right-hand side b.

        Parameters
        ----------
        matrix : (n, n) sparse float64
            A.

        Returns
        -------
        callable
            (n,) to (n,) float64. It raises SolverError where the matrix is singular.
        """
        if self._directly or matrix.shape[0] <= _DIRECT_UP_TO:
            return self._factor(matrix)
        cycle = Multigrid(matrix)
        preconditioner = sla.LinearOperator(matrix.shape, matvec=cycle, dtype=np.float64)
        factor: list[Solve] = []

        def solve(right_hand_side: NDArray[np.float64]) -> NDArray[np.float64]:
            if factor:
                return factor[0](right_hand_side)
            solution, failed = sla.cg(
                matrix,
                right_hand_side,
                rtol=_TOLERANCE,
                atol=0.0,
                maxiter=_MOST_STEPS,
                M=preconditioner,
                callback=lambda _solution: self._tick(None),
            )
            if failed:
                self._directly = True
                factor.append(self._factor(matrix))
                return factor[0](right_hand_side)
            return np.asarray(solution, dtype=np.float64)

        return solve

    def _factor(self, matrix: sp.csr_array) -> Solve:
        return Factor(matrix, self._positions).solve
