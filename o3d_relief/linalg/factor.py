"""A sparse factor that is kept, for systems that are solved again and again."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sla
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from threadpoolctl import threadpool_limits

from o3d_relief.errors import SolverError

__all__ = ["Factor", "nested_dissection"]

_LEAF = 64
"""Vertices that are not divided further; their own order hardly matters."""

_BADLY_CUT = 50.0
"""Squares of the sizes of all separators, for each unknown, from which planes cut too much: some 20 on
surfaces of even triangles, hundreds where triangles reach through the scene or springs tie its parts."""


def nested_dissection(
    positions: NDArray[np.float64], matrix: sp.csr_array
) -> tuple[NDArray[np.int64], float]:
    """Order the unknowns of a mesh so that a factor of its matrix stays sparse.

    The vertices are halved again and again by a plane across their longest extent. In the graph of the
    matrix the vertices at each cut separate the two halves; they come after both of them. On a surface the
    separators are short curves, and a factor has about n log n entries (George 1973).

    Parameters
    ----------
    positions : (n, 3) float64
    matrix : (n, n) sparse, CSR
        With a symmetric pattern.

    Returns
    -------
    order : (n,) int64
        The unknowns in their new order.
    cut : float
        The sum of the squares of the sizes of all separators, for each unknown: the larger, the more entries
        will the factor have.
    """
    n = len(positions)
    part, depth, deepest = _halves(positions)
    row = np.repeat(np.arange(n), np.diff(matrix.indptr))
    cut = (row < matrix.indices) & (part[row] != part[matrix.indices])
    row, column = row[cut], matrix.indices[cut].astype(np.int64)
    # The first bit in which two numbers of parts differ says at which depth a plane has come between them.
    level = deepest - np.frexp((part[row] ^ part[column]).astype(np.float64))[1]
    first, second = np.where(part[row] < part[column], (row, column), (column, row))
    order = np.argsort(level, kind="stable")
    begin = np.searchsorted(level[order], np.arange(deepest + 1))
    separates = np.full(n, deepest + 1)
    for at in range(deepest):
        edge = order[begin[at] : begin[at + 1]]
        edge = edge[(separates[first[edge]] > at) & (separates[second[edge]] > at)]
        separates[first[edge]] = at
    at = np.minimum(separates, depth)
    node = part >> (deepest - at)
    _, size = np.unique(node[separates < depth], return_counts=True)
    return np.lexsort((-at, (node + 1) << (deepest - at))), float((size.astype(np.float64) ** 2).sum() / n)


def _halves(positions: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.int64], int]:
    """Halve points by planes again and again.

    Return their parts, numbered like the leaves of a full binary tree, their depths, and the largest depth.
    """
    tree = cKDTree(positions, leafsize=_LEAF, compact_nodes=False)
    part, depth = np.zeros((2, len(positions)), dtype=np.int64)
    waiting = [(tree.tree, 1, 0)]
    while waiting:
        node, number, below = waiting.pop()
        if node.lesser is None:
            here = tree.indices[node.start_idx : node.end_idx]
            part[here], depth[here] = number, below
        else:
            waiting += [(node.lesser, 2 * number, below + 1), (node.greater, 2 * number + 1, below + 1)]
    deepest = int(depth.max(initial=0))
    return part << (deepest - depth), depth, deepest


class Factor:
    """A factor of a sparse symmetric positive definite matrix over the vertices of a mesh.

    It takes some 1.8 kB of memory for each vertex of a surface of 250,000, and 10 % more for each doubling.

    Parameters
    ----------
    matrix : (n, n) sparse float64, CSR
    positions : (n, 3) float64 or None
        Of the vertices that the unknowns belong to; None: the unknowns are ordered by minimum degree.
    ordered : bool
        Take the unknowns in the order in which they are.

    Attributes
    ----------
    order : (n,) int64
        The unknowns in the order in which right-hand sides of several columns are given.
    entries : int
        Number of entries of the factor.

    Raises
    ------
    SolverError
        The matrix is singular.
    """

    def __init__(
        self, matrix: sp.csr_array, positions: NDArray[np.float64] | None, *, ordered: bool = False
    ) -> None:
        n = matrix.shape[0]
        self.order, cut = np.arange(n), np.inf
        if positions is not None:
            self.order, cut = nested_dissection(positions, matrix)
        # Minimum degree is better where planes cut much, and slow on large fine surfaces, where they do not.
        by_planes = cut < _BADLY_CUT
        if not by_planes:
            self.order = np.arange(n)
        self.order.flags.writeable = False
        columns = (matrix[self.order][:, self.order] if by_planes else matrix).tocsc()
        try:
            with threadpool_limits(limits=1):
                self._factor = sla.splu(
                    columns,
                    permc_spec="NATURAL" if by_planes or ordered else "MMD_AT_PLUS_A",
                    # Small panels are faster where the unknowns have few neighbours, as in spaces of patches.
                    **({"panel_size": 4, "relax": 1} if ordered else {}),
                    diag_pivot_thresh=0.0,
                    options={"SymmetricMode": True},
                )
        except RuntimeError as error:  # SuperLU: exactly singular
            raise SolverError(f"A linear system of {n} unknowns is singular.") from error
        self.entries = int(self._factor.nnz)

    def elimination(self) -> NDArray[np.int64]:
        """Return the order in which the unknowns are eliminated, (n,)."""
        return np.asarray(self.order[np.argsort(self._factor.perm_c)], dtype=np.int64)

    def solve(self, right_hand_side: NDArray[np.float64]) -> NDArray[np.float64]:
        """Solve for one right-hand side, (n,)."""
        solution = np.zeros(len(right_hand_side))
        solution[self.order] = self.solve_ordered(right_hand_side[self.order])
        return solution

    def solve_ordered(self, right_hand_sides: NDArray[np.float64]) -> NDArray[np.float64]:
        """Solve for (n,) or (n, q), whose rows, and those of the solution, are in `order`."""
        with threadpool_limits(limits=1):
            return np.asarray(self._factor.solve(right_hand_sides), dtype=np.float64)
