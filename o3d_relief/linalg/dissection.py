"""An order of the unknowns of a mesh in which factors of its matrices stay sparse."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.spatial import cKDTree

__all__ = ["Dissection", "nested_dissection"]

_LEAF = 64
"""Vertices that are not divided further; their own order hardly matters."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Dissection:
    """The unknowns in blocks, each of them after all that it separates.

    Attributes
    ----------
    order : (n,) int64
        The unknowns in their new order.
    starts : (b + 1,) int64
        Where each block begins in `order`, and n.
    cut : float
        The sum of the squares of the sizes of all separators, for each unknown: the larger, the more entries
        will a factor have.
    """

    order: NDArray[np.int64]
    starts: NDArray[np.int64]
    cut: float


def nested_dissection(positions: NDArray[np.float64], matrix: sp.csr_array) -> Dissection:
    """Order the unknowns of a mesh so that a factor of its matrix stays sparse.

    The vertices are halved again and again by a plane across their longest extent. In the graph of the
    matrix the vertices at each cut separate the two halves; they come after both of them. On a surface the
    separators are short curves, and a factor has about n log n entries (George 1973). Each separator, and
    what is not divided further, is a block; within a block neighbours in space are neighbours in the order.

    Parameters
    ----------
    positions : (n, 3) float64
    matrix : (n, n) sparse, CSR
        With a symmetric pattern.

    Returns
    -------
    Dissection
    """
    n = len(positions)
    part, depth, deepest = _halves(positions)
    separates = np.minimum(_first_cut(matrix, part, deepest), depth)
    node = part >> (deepest - separates)
    order = np.lexsort((part, -separates, (node + 1) << (deepest - separates)))
    at, node = separates[order], node[order]
    begins = np.ones(n, dtype=bool)
    begins[1:] = (at[1:] != at[:-1]) | (node[1:] != node[:-1])
    starts = np.append(np.flatnonzero(begins), n)
    inner = at[starts[:-1]] < depth[order[starts[:-1]]]
    sizes = np.diff(starts)[inner].astype(np.float64)
    return Dissection(order=order, starts=starts, cut=float((sizes**2).sum() / max(n, 1)))


def _first_cut(matrix: sp.csr_array, part: NDArray[np.int64], deepest: int) -> NDArray[np.int64]:
    """Find the depth at which each unknown separates others, (n,); `deepest` + 1 for those that never do."""
    n = matrix.shape[0]
    row, column = np.repeat(np.arange(n), np.diff(matrix.indptr)), matrix.indices
    cut = np.flatnonzero(row < column)
    cut = cut[part[row[cut]] != part[column[cut]]]
    row, column = row[cut], column[cut].astype(np.int64)
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
    return separates


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
