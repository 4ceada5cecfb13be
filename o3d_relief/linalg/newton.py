"""The systems of Newton's method: a form and springs on constraints, for all unknowns or within a space."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from o3d_relief.linalg.factor import Factor, superlu

__all__ = ["Everywhere", "Solve", "Within"]

_FILL = 1.05
"""Growth of a factor, by rows that have come, from which on its unknowns are ordered anew."""

Solve = Callable[[NDArray[np.float64]], NDArray[np.float64]]


class Everywhere:
    """Systems for all unknowns.

    Parameters
    ----------
    form : (n, n) sparse float64
    positions : (n, 3) float64 or None
        See `Factor`.
    """

    def __init__(self, form: sp.csr_array, positions: NDArray[np.float64] | None) -> None:
        self._form, self._positions = form, positions
        self._order, self._entries = np.zeros(0, dtype=np.int64), 0

    def prepare(self, diagonal: NDArray[np.float64], rows: sp.csr_array, stiff: NDArray[np.float64]) -> Solve:
        """Return what solves (H + D + R' S R) x = b for a right-hand side b.

        Parameters
        ----------
        diagonal : (n,) float64
            D.
        rows : (p, n) sparse float64
            R.
        stiff : (p,) float64
            S.

        Returns
        -------
        callable
            (n,) to (n,) float64.

        Raises
        ------
        SolverError
            The matrix is singular or not positive definite.
        """
        springs = rows.T @ (sp.diags_array(stiff) @ rows)
        matrix = (self._form + sp.diags_array(diagonal) + springs).tocsr()
        if not self._entries:
            factor = Factor(matrix, self._positions)
            if factor.minimum_degree is not None:
                # The next matrices are nearly the same: their unknowns are taken in this order.
                self._order = np.argsort(factor.minimum_degree.perm_c)
                self._entries = factor.minimum_degree.nnz
            return factor.solve
        order = self._order
        ordered = superlu(matrix[order][:, order], ordered=True)
        if ordered.nnz > _FILL * self._entries:
            self._entries = 0

        def solve(right: NDArray[np.float64]) -> NDArray[np.float64]:
            solution = np.zeros(len(right))
            solution[order] = ordered.solve(right[order])
            return solution

        return solve


class Within:
    """Systems whose solutions are sought within a space of few dimensions.

    Parameters
    ----------
    form : (n, n) sparse float64
    maps : (n, q) sparse float64
        A basis of the space.
    """

    def __init__(self, form: sp.csr_array, maps: sp.csr_array) -> None:
        self._maps, self._back = maps, maps.T.tocsr()
        self._form = self._back @ (form @ maps)
        self._ordered, self._entries = False, 0

    def prepare(self, diagonal: NDArray[np.float64], rows: sp.csr_array, stiff: NDArray[np.float64]) -> Solve:
        """See `Everywhere`; x is in the space, and only what the space has of b counts."""
        maps, back = self._maps, self._back
        inside = rows @ maps
        springs = inside.T @ (sp.diags_array(stiff) @ inside)
        matrix = (self._form + back @ (sp.diags_array(diagonal) @ maps) + springs).tocsr()
        factor = superlu(matrix, ordered=self._ordered)
        if not self._ordered:
            # The next matrices are nearly the same: their unknowns come in this order.
            order = np.argsort(factor.perm_c)
            self._maps, self._back = maps[:, order], back[order]
            self._form = self._form[order][:, order]
            self._ordered, self._entries = True, factor.nnz
        elif factor.nnz > _FILL * self._entries:
            self._ordered = False
        return lambda right: np.asarray(maps @ factor.solve(back @ right))
