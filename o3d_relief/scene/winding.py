"""Faces of one surface that turn different ways."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

__all__ = ["wrongly_wound"]


def wrongly_wound(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Find the faces that turn the other way than most of the surface around them.

    Faces are compared across the edges that two of them share. In each patch of faces that hang together
    by such edges the orientation of the larger area is right. A patch that cannot be oriented, such as a
    Möbius strip, is left alone.

    Each face stands in a graph twice, as it is and turned round; neighbours are linked so that they agree.
    A patch that can be oriented is then two components, mirror images of each other.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int64
        Without duplicates.

    Returns
    -------
    (m,) bool

    Examples
    --------
    >>> square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 2, 0.0]])
    >>> wrongly_wound(square, np.array([[0, 1, 2], [0, 3, 2]])).tolist()
    [True, False]
    """
    m = len(faces)
    # Where no edge is walked the same way twice, all faces that share one agree.
    directed = np.sort(faces * (int(faces.max()) + 1) + faces[:, [1, 2, 0]], axis=None)
    if (directed[1:] != directed[:-1]).all():
        return np.zeros(m, dtype=bool)
    one, other, agree = _neighbours(faces)
    if agree.all():
        return np.zeros(m, dtype=bool)
    # The turned copy of face i is i + m.
    start = np.concatenate([one, one + m])
    end = np.where(np.tile(agree, 2), np.concatenate([other, other + m]), np.concatenate([other + m, other]))
    graph = sp.coo_array((np.ones(len(start), dtype=np.int8), (start, end)), shape=(2 * m, 2 * m))
    _, side = connected_components(graph, directed=False)
    as_is, turned = side[:m], side[m:]
    a, b, c = vertices[faces].transpose(1, 0, 2)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    # The area of the faces that a component holds as they are; its mirror image holds the others so.
    share = np.bincount(as_is, weights=area, minlength=int(side.max()) + 1)
    lower = share[as_is] < share[turned]
    even = (share[as_is] == share[turned]) & (as_is > turned)
    return np.asarray((lower | even) & (as_is != turned))


def _neighbours(
    faces: NDArray[np.int64],
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.bool_]]:
    """Return the pairs of faces that share an edge with no third one, and whether they turn the same way."""
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    key = np.minimum(start, end) * (int(faces.max()) + 1) + np.maximum(start, end)
    order = np.argsort(key, kind="stable")
    ordered = key[order]
    same = np.concatenate([[False], ordered[1:] == ordered[:-1], [False]])
    # The first of exactly two equal keys.
    first = np.flatnonzero(~same[:-2] & same[1:-1] & ~same[2:])
    one, other = order[first], order[first + 1]
    return one // 3, other // 3, np.asarray(start[one] != start[other])
