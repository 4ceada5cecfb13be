"""Edges that have begun to pierce triangles, and what lies beside them."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from o3d_relief.bounds.crossings import DEEP, Crossings, crossings, once, stretches
from o3d_relief.bounds.origin import triangles_cross
from o3d_relief.bounds.pairs import Pairs
from o3d_relief.bounds.ragged import combined

__all__ = ["around", "new_crossings"]

_SHALLOW = 1e-4
"""How deep, in place of `DEEP`, surfaces that were apart must cross to be mended: what is deepest between two
edges is less deep at them."""

_SURE = 0.999 * DEEP
"""The same for surfaces in contact: the finished mesh is welded and cut, and rounds once more."""

_FEW = 30
"""So many crossings at most are looked at together with what is next to them: of more, it takes longer than
the rounds that it saves."""


def new_crossings(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    edges: NDArray[np.int64],
    z: NDArray[np.float64],
) -> tuple[Pairs, int]:
    """Find the edges that pierce a triangle in front of S now, and did not before.

    Parameters
    ----------
    vertices : (n, 3) float64
        Before.
    faces : (m, 3) int64
    edges : (e, 2) int64
    z : (n,) float64
        Heights now.

    Returns
    -------
    pairs : Pairs
        Two for each of them, in the order of before, and those next to them that are out of order, too.
    count : int
        Number of crossings.
    """
    before = vertices[:, 2]
    # Neither edges nor triangles behind S count: no rays for them.
    in_front, (a, b, c) = z > 0.0, faces.T
    front = faces.compress(in_front[a] | in_front[b] | in_front[c], axis=0)
    rising = edges.compress(in_front[edges[:, 0]] | in_front[edges[:, 1]], axis=0)
    found = crossings(np.column_stack([vertices[:, :2], z]), front, rising)
    new = found.pierced(z, deep=_SURE) & ~found.pierced(before)
    apart = np.abs(found.gaps(before)).max(axis=1) > DEEP
    new |= apart & found.pierced(z, deep=_SHALLOW) & ~found.pierced(before, deep=_SHALLOW / 2.0)
    found = found.select(new)
    pairs = found.pairs(before, z)
    if not 0 < len(found) <= _FEW:
        return pairs, len(found)
    beside = around(found, vertices, faces)
    beside = beside.select(~beside.pierced(before) & (np.abs(beside.gaps(before)).max(axis=1) > DEEP))
    close = beside.pairs(before, z)
    return Pairs.join([pairs, close.select(np.subtract(*close.heights(z)) < 0.0)]), len(found)


def around(
    found: Crossings, vertices: NDArray[np.float64], faces: NDArray[np.int64], *, uncrossed: bool = False
) -> Crossings:
    """Return the edges near crossings, each with the triangles near its crossing that lie above or below it.

    What is kept apart at one edge likes to cross at the next: they belong together.

    Parameters
    ----------
    found : Crossings
    vertices : (n, 3) float64
    faces : (m, 3) int64
    uncrossed : bool
        Of triangles that do not cross each other only.

    Returns
    -------
    Crossings
        Among the edges of all triangles that share a vertex with one of the two, and the triangles that
        share a vertex with the other.
    """
    here = np.zeros(len(vertices), dtype=bool)
    here[found.edge] = True
    here[found.face] = True
    a, b, c = faces.T
    faces = faces[here[a] | here[b] | here[c]]
    n, m = len(vertices), len(faces)
    entries = np.ones(faces.size, dtype=bool), (faces.ravel(), np.repeat(np.arange(m), 3))
    beside = sp.csr_array(entries, shape=(n, m))
    query, at_edge = _beside(beside, found.edge)
    other_query, at_face = _beside(beside, found.face)
    first, second = combined(query, other_query)
    one, other = np.divmod(once(at_edge[first] * m + at_face[second]), m)
    one, other = np.concatenate([one, other]), np.concatenate([other, one])
    # Corner by corner: numpy takes several times as long over axes of two or three.
    corner = np.ascontiguousarray(faces.T)
    overlap = np.ones(len(one), dtype=bool)
    for place in vertices[:, 0][corner], vertices[:, 1][corner]:
        low, high = place.min(axis=0), place.max(axis=0)
        overlap &= (low[one] <= high[other]) & (low[other] <= high[one])
    if uncrossed:
        overlap[overlap] = ~triangles_cross(vertices[faces[one[overlap]]], vertices[faces[other[overlap]]])
    one, other = one[overlap], other[overlap]
    corner, opposite = corner[:, one], corner[:, other]
    apart = [(own != opposite).all(axis=0) for own in corner]
    keys = []
    for begin, end in ((0, 1), (1, 2), (2, 0)):
        free = np.flatnonzero(apart[begin] & apart[end])
        tips = corner[begin, free], corner[end, free]
        keys.append((np.minimum(*tips) * n + np.maximum(*tips)) * m + other[free])
    edge, face = np.divmod(once(np.concatenate(keys)), m)
    return stretches(vertices[:, :2], np.stack(np.divmod(edge, n), axis=1), faces[face])


def _beside(beside: sp.csr_array, corners: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the faces with one of some corners (q, c), each once: number of the row, rising, and face."""
    rows = beside[corners.ravel()]
    query = np.repeat(np.repeat(np.arange(len(corners)), corners.shape[1]), np.diff(rows.indptr))
    return np.divmod(once(query * beside.shape[1] + rows.indices), beside.shape[1])
