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


def nested_dissection(positions: NDArray[np.float64], matrix: sp.csr_array) -> NDArray[np.int64]:
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
    (n,) int64
        The unknowns in their new order.
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
    last = ((part >> (deepest - at)) + 1) << (deepest - at)
    return np.lexsort((-at, last))


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

    It takes some 1.7 kB of memory for each vertex of a surface of 250,000, and 10 % more for each doubling.

    Parameters
    ----------
    matrix : (n, n) sparse float64, CSR
    positions : (n, 3) float64
        Of the vertices that the unknowns belong to.

    Raises
    ------
    SolverError
        The matrix is singular.
    """

    def __init__(self, matrix: sp.csr_array, positions: NDArray[np.float64]) -> None:
        self._order = nested_dissection(positions, matrix)
        ordered = matrix[self._order][:, self._order].tocsc()
        try:
            with threadpool_limits(limits=1):
                self._factor = sla.splu(
                    ordered, permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
                )
        except RuntimeError as error:  # SuperLU: exactly singular
            raise SolverError(f"A linear system of {len(positions)} unknowns is singular.") from error

    def solve(self, right_hand_side: NDArray[np.float64]) -> NDArray[np.float64]:
        """Solve for one right-hand side, (n,), or for several, (n, q)."""
        solution = np.zeros(right_hand_side.shape)
        with threadpool_limits(limits=1):
            solution[self._order] = self._factor.solve(right_hand_side[self._order])
        return solution
