"""A sparse factor that is kept, for systems that are solved again and again."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sla
from numpy.typing import NDArray

from o3d_relief.errors import SolverError
from o3d_relief.linalg.cholesky import Cholesky
from o3d_relief.linalg.dissection import nested_dissection
from o3d_relief.linalg.one_thread import one_thread

__all__ = ["Factor", "superlu"]

_BADLY_CUT = 50.0
"""Squares of the sizes of all separators, for each unknown, from which planes cut too much: some 20 on
surfaces of even triangles, hundreds where triangles reach through the scene or springs tie its parts."""


class Factor:
    """A factor of a sparse symmetric positive definite matrix over the vertices of a mesh.

    On a surface of 250,000 vertices it takes some 1.0 kB of memory for each, and 7 % more for each doubling.

    Parameters
    ----------
    matrix : (n, n) sparse float64, CSR
    positions : (n, 3) float64 or None
        Of the vertices that the unknowns belong to; None: the unknowns are ordered by minimum degree.

    Attributes
    ----------
    order : (n,) int64
        The unknowns in the order in which right-hand sides of several columns are given.
    minimum_degree : scipy.sparse.linalg.SuperLU or None
        The factor, where the unknowns are ordered by minimum degree: without positions, and where planes cut
        too much.

    Raises
    ------
    SolverError
        The matrix is singular or not positive definite.
    """

    def __init__(self, matrix: sp.csr_array, positions: NDArray[np.float64] | None) -> None:
        self.order = np.arange(matrix.shape[0])
        dissection = None if positions is None else nested_dissection(positions, matrix)
        with one_thread():
            if dissection is not None and dissection.cut < _BADLY_CUT:
                self.order = dissection.order
                self._factor: Cholesky | sla.SuperLU = Cholesky(matrix, dissection)
                self.minimum_degree = None
            else:
                # Minimum degree is better where planes cut much, and slow on large fine surfaces.
                self._factor = self.minimum_degree = superlu(matrix)
        self.order.flags.writeable = False

    def solve(self, right_hand_side: NDArray[np.float64]) -> NDArray[np.float64]:
        """Solve for one right-hand side, (n,)."""
        solution = np.zeros(len(right_hand_side))
        solution[self.order] = self.solve_ordered(right_hand_side[self.order])
        return solution

    def solve_ordered(
        self, right_hand_sides: NDArray[np.float64], *, overwrite: bool = False
    ) -> NDArray[np.float64]:
        """Solve for (n,) or (n, q), whose rows, and those of the solution, are in `order`.

        With `overwrite` the solution may take the place of the right-hand sides.
        """
        with one_thread():
            if isinstance(self._factor, Cholesky):
                return self._factor.solve(right_hand_sides, overwrite=overwrite)
            return np.asarray(self._factor.solve(right_hand_sides), dtype=np.float64)


def superlu(matrix: sp.csr_array, *, ordered: bool = False) -> sla.SuperLU:
    """Factorise a symmetric positive definite matrix of any graph.

    Parameters
    ----------
    matrix : (n, n) sparse float64
    ordered : bool
        Take the unknowns in the order in which they are, not by minimum degree.

    Returns
    -------
    scipy.sparse.linalg.SuperLU
        Its `perm_c` tells the place of each unknown in the order of elimination.

    Raises
    ------
    SolverError
        The matrix is singular.
    """
    try:
        return sla.splu(
            matrix.tocsc(),
            permc_spec="NATURAL" if ordered else "MMD_AT_PLUS_A",
            # Small panels are faster where the unknowns have few neighbours, as in spaces of patches.
            **({"panel_size": 4, "relax": 1} if ordered else {}),
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
    except RuntimeError as error:  # SuperLU: exactly singular
        raise SolverError(f"A linear system of {matrix.shape[0]} unknowns is singular.") from error
