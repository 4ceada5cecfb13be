"""Polygons and strips to triangles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["fan", "strips"]


def fan(counts: NDArray[np.int64]) -> NDArray[np.int64]:
    """Cut polygons into triangles round their first corner, in their order.

    Parameters
    ----------
    counts : (p,) int64
        Number of corners of each polygon. Fewer than three make no triangle.

    Returns
    -------
    (m, 3) int64
        Positions in the list of all corners, the polygons one after the other.

    Examples
    --------
    >>> fan(np.array([3, 4])).tolist()
    [[0, 1, 2], [3, 4, 5], [3, 5, 6]]
    """
    triangles = np.maximum(counts - 2, 0)
    first = np.repeat(np.cumsum(counts) - counts, triangles)
    step = np.arange(triangles.sum()) - np.repeat(np.cumsum(triangles) - triangles, triangles)
    return np.stack([first, first + step + 1, first + step + 2], axis=1)


def strips(corners: NDArray[np.int64]) -> NDArray[np.int64]:
    """Cut triangle strips, ended by -1, into triangles.

    Parameters
    ----------
    corners : (p,) int64
        Vertex indices of the strips, one after the other.

    Returns
    -------
    (m, 3) int64
        Triangles, all with the orientation of the first of their strip; those that use a vertex twice
        (they only turn the strip) are left out.

    Examples
    --------
    >>> strips(np.array([0, 1, 2, 3, -1, 4, 5, 6])).tolist()
    [[0, 1, 2], [2, 1, 3], [4, 5, 6]]
    """
    place = np.arange(len(corners))
    start = np.maximum.accumulate(np.where(corners < 0, place + 1, 0))
    faces = np.stack([corners[:-2], corners[1:-1], corners[2:]], axis=1)
    odd = (place - start)[: len(faces)] % 2 == 1
    faces[odd, :2] = faces[odd, 1::-1]
    a, b, c = faces.T
    return np.asarray(faces[(faces >= 0).all(axis=1) & (a != b) & (b != c) & (c != a)])
