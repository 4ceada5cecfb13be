"""Edges halved, on both sides alike, so that faces which met still meet."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Halved", "halved"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Halved:
    """Faces after some of their edges were halved.

    Attributes
    ----------
    pairs : (p, 2) int64
        Vertices in whose middles the new vertices lie, which have the numbers from n on.
    faces : (q, 3) int64
    source : (q,) int64
        The face that each lies in, in rising order.
    corners : (q, 3) int64
        Where in that face: 0 to 2 are its corners, 3 to 5 the middles of its edges.
    """

    pairs: NDArray[np.int64]
    faces: NDArray[np.int64]
    source: NDArray[np.int64]
    corners: NDArray[np.int64]


def halved(faces: NDArray[np.int64], chosen: NDArray[np.bool_], count: int) -> Halved:
    """Halve edges of faces.

    Parameters
    ----------
    faces : (m, 3) int64
    chosen : (m, 3) bool
        The edges from corner k to the next one that are halved: an edge of several faces in all of them.
    count : int
        Number of vertices, n.

    Returns
    -------
    Halved

    Examples
    --------
    >>> halved(np.array([[0, 1, 2]]), np.array([[True, False, False]]), 3).faces.tolist()
    [[0, 3, 2], [3, 1, 2]]
    """
    ends = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2)
    low, high = ends.min(axis=2)[chosen], ends.max(axis=2)[chosen]
    keys, number = np.unique(low * count + high, return_inverse=True)
    middle = np.full(faces.shape, -1)
    middle[chosen] = count + number.ravel()
    six = np.concatenate([faces, middle], axis=1)
    corners, source = [], []
    for case, triangles in _PATTERNS.items():
        mine = np.flatnonzero((chosen == case).all(axis=1))
        for triangle in triangles:
            corners.append(np.tile(np.array(triangle), (len(mine), 1)))
            source.append(mine)
    order = np.argsort(np.concatenate(source), kind="stable")
    rows, places = np.concatenate(source)[order], np.concatenate(corners)[order]
    return Halved(
        pairs=np.stack([keys // count, keys % count], axis=1),
        faces=six[rows[:, None], places],
        source=rows,
        corners=places,
    )


def _patterns() -> dict[tuple[bool, bool, bool], list[list[int]]]:
    """Return the triangles of each case of edges that are halved: corners 0 to 2, middles 3 to 5."""
    first = {
        (False, False, False): [[0, 1, 2]],
        (True, False, False): [[0, 3, 2], [3, 1, 2]],
        (True, True, False): [[3, 1, 4], [0, 3, 4], [0, 4, 2]],
        (True, True, True): [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]],
    }
    result = {}
    for case, triangles in first.items():
        for turn in range(3):
            # Turning the corners by one turns the edges by one, too.
            turned = (case[-turn % 3], case[(1 - turn) % 3], case[(2 - turn) % 3])
            result[turned] = [[(k % 3 + turn) % 3 + 3 * (k >= 3) for k in triangle] for triangle in triangles]
    return result


_PATTERNS = _patterns()
