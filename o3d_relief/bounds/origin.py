"""What crossed already in the scene, asked of surfaces that cross in a relief."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

__all__ = ["Origin", "triangles_cross"]


class Origin:
    """The triangles of the scene that the triangles of a trimmed relief are parts of.

    Parameters
    ----------
    faces : (m_out, 3) int64
        Of the relief.
    parents : (m_out, 3) int64
        Vertices of the scene's triangle that each of them is a part of.
    scene : (n, 3) float64
    """

    def __init__(
        self, faces: NDArray[np.int64], parents: NDArray[np.int64], scene: NDArray[np.float64]
    ) -> None:
        self._faces = faces
        self._corners = scene[parents]
        n = int(faces.max(initial=0)) + 1
        entries = np.ones(faces.size, dtype=bool), (faces.ravel(), np.repeat(np.arange(len(faces)), 3))
        self._around = sp.csr_array(entries, shape=(n, len(faces)))

    def crossed(self, one: NDArray[np.int64], other: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Tell whether triangles around two places of the relief crossed each other in the scene.

        Parameters
        ----------
        one, other : (q, 3) int64
            Each place as the vertices of a triangle, of an edge (one of them twice) or one vertex, thrice.

        Returns
        -------
        (q,) bool
            True where a triangle at the one place crossed a triangle at the other.
        """
        row, a, b = self._combined(one, other)
        found = triangles_cross(self._corners[a], self._corners[b])
        return np.bincount(row, weights=found, minlength=len(one)) > 0

    def meet(self, one: NDArray[np.int64], other: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Tell whether triangles around two places of the relief share a vertex.

        Parameters
        ----------
        one, other : (q, 3) int64
            As in `crossed`.

        Returns
        -------
        (q,) bool
        """
        row, a, b = self._combined(one, other)
        found = (self._faces[a][:, :, None] == self._faces[b][:, None, :]).any(axis=(1, 2))
        return np.bincount(row, weights=found, minlength=len(one)) > 0

    def _combined(
        self, one: NDArray[np.int64], other: NDArray[np.int64]
    ) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
        """Return all combinations of the triangles at both places: number of the query, both triangles."""
        query, first = self._at(one)
        second_query, second = self._at(other)
        count = np.bincount(second_query, minlength=len(one))
        begin = np.cumsum(count) - count
        times = count[query]
        row = np.repeat(np.arange(len(query)), times)
        within = np.arange(len(row)) - np.repeat(np.cumsum(times) - times, times)
        return query[row], first[row], second[begin[query[row]] + within]

    def _at(self, places: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return the triangles that hold all vertices of each place: numbers of places, rising, and faces."""
        around = self._around[places[:, 0]]
        query = np.repeat(np.arange(len(places)), np.diff(around.indptr))
        face = around.indices.astype(np.int64)
        holds = (self._faces[face][:, :, None] == places[query][:, None, :]).any(axis=1).all(axis=1)
        return query[holds], face[holds]


def triangles_cross(one: NDArray[np.float64], other: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Tell which pairs of triangles cross each other, by an edge of the one that pierces the other.

    Parameters
    ----------
    one, other : (q, 3, 3) float64
        Corners.

    Returns
    -------
    (q,) bool
        Touching, and lying in one plane, is not crossing.

    Examples
    --------
    >>> flat = np.array([[[0, 0, 0], [4, 0, 0], [0, 4, 0.0]]])
    >>> needle = np.array([[[1, 1, -1], [1, 1, 1], [9, 9, 1.0]]])
    >>> triangles_cross(flat, needle), triangles_cross(flat, needle + [0, 0, 1.0])
    (array([ True]), array([False]))
    """
    result = np.zeros(len(one), dtype=bool)
    for edges, face in ((one, other), (other, one)):
        a, b, c = face[:, 0], face[:, 1], face[:, 2]
        for i in range(3):
            p, q = edges[:, i], edges[:, (i + 1) % 3]
            apart = _volume(a, b, c, p) * _volume(a, b, c, q) < 0.0
            sides = np.stack([_volume(p, q, a, b), _volume(p, q, b, c), _volume(p, q, c, a)])
            result |= apart & ((sides > 0.0).all(axis=0) | (sides < 0.0).all(axis=0))
    return result


def _volume(
    a: NDArray[np.float64], b: NDArray[np.float64], c: NDArray[np.float64], d: NDArray[np.float64]
) -> NDArray[np.float64]:
    return np.asarray((np.cross(b - a, c - a) * (d - a)).sum(axis=1))
