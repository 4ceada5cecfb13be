"""Multigrid for one system that is solved again and again, each time with other unknowns held."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from pyamg import amg_core

from o3d_relief.linalg.multigrid import Multigrid, aggregates, smoothed, sorted_matrix

__all__ = ["HeldMatrix", "HeldMultigrid"]

_NOTHING_LEFT = 1e-8
"""Share of its diagonal below which a coarse unknown has only held ones under it."""

_HARDLY_CHANGED = 0.1
"""Share of the held unknowns of which fewer may change before the coarser levels are made anew."""


class HeldMatrix:
    """A symmetric matrix on the vectors that are zero where unknowns are held.

    Parameters
    ----------
    matrix : (n, n) sparse float64
    moving : (n,) bool
        The unknowns that are not held.
    """

    def __init__(self, matrix: sp.csr_array, moving: NDArray[np.bool_]) -> None:
        self._matrix, self._moving = matrix, moving.astype(np.float64)

    def __matmul__(self, vector: NDArray[np.float64]) -> NDArray[np.float64]:
        product: NDArray[np.float64] = self._matrix @ vector
        product *= self._moving
        return product


class HeldMultigrid:
    """One symmetric V-cycle, see `Multigrid`, that leaves held unknowns at zero.

    Which ones are held is changed for little: the finest level stays, what is held leaves its interpolation,
    and the coarser matrix is corrected where that changes it. Conjugate gradients take as many steps as with
    a hierarchy of the matrix without these unknowns.

    Parameters
    ----------
    matrix : (n, n) sparse float64
        Symmetric, with a positive diagonal. Nothing is held at first.
    """

    def __init__(self, matrix: sp.csr_array) -> None:
        self._matrix = sorted_matrix(matrix)
        self._interpolation = smoothed(self._matrix, aggregates(self._matrix))
        self._restriction = self._interpolation.T.tocsr()
        self._coarse = sorted_matrix(self._restriction @ (self._matrix @ self._interpolation))
        self._lower = sorted_matrix(sp.tril(self._matrix, format="csr"))
        self._upper = sorted_matrix(sp.triu(self._matrix, format="csr"))
        self._diagonal = self._matrix.diagonal()
        self._made_for = np.ones(matrix.shape[0], dtype=bool)
        self._coarser = Multigrid(self._coarse)
        self.hold(self._made_for)

    def hold(self, moving: NDArray[np.bool_]) -> None:
        """Hold all but the moving unknowns, (n,) bool, from now on."""
        changed = np.count_nonzero(moving != self._made_for)
        if changed > _HARDLY_CHANGED * np.count_nonzero(~moving):
            self._made_for = moving.copy()
            self._coarser = Multigrid(self._coarse_without(np.flatnonzero(~moving)))
        self._moving = moving.astype(np.float64)
        self._numbers = np.flatnonzero(moving).astype(np.int32)

    def _coarse_without(self, held: NDArray[np.int64]) -> sp.csr_array:
        """Return the coarser matrix for an interpolation P without the rows of held unknowns."""
        rows, own = self._interpolation[held], self._matrix[held]
        # (P - E P)' A (P - E P) with E P, the rows that leave.
        change = rows.T @ (own @ self._interpolation - 0.5 * (own[:, held] @ rows))
        coarse = self._coarse - change - change.T
        whole = self._coarse.diagonal()
        empty = coarse.diagonal() <= _NOTHING_LEFT * whole
        return sp.csr_array(coarse + sp.diags_array(np.where(empty, whole, 0.0)))

    def __call__(self, right_hand_side: NDArray[np.float64]) -> NDArray[np.float64]:
        """Find an approximate solution, (n,)."""
        first = self._sweep(self._lower, right_hand_side, backwards=False)
        scaled = self._diagonal * first
        rest = scaled - self._upper @ first
        rest *= self._moving
        correction = self._interpolation @ self._coarser(self._restriction @ rest)
        correction *= self._moving
        scaled += self._diagonal * correction
        scaled -= self._lower @ correction
        return self._sweep(self._upper, scaled, backwards=True)

    def _sweep(
        self, triangle: sp.csr_matrix, right_hand_side: NDArray[np.float64], *, backwards: bool
    ) -> NDArray[np.float64]:
        """Solve with a triangular matrix for the unknowns that move."""
        n = len(self._numbers)
        solution = np.zeros(len(right_hand_side))
        sweep = (n - 1, -1, -1) if backwards else (0, n, 1)
        parts = triangle.indptr, triangle.indices, triangle.data
        amg_core.gauss_seidel_indexed(*parts, solution, right_hand_side, self._numbers, *sweep)
        return solution
