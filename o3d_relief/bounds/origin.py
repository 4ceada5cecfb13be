"""What crossed already in the scene, asked of surfaces that cross in a relief."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from o3d_relief.bounds.ragged import combined

__all__ = ["Origin", "triangles_cross", "triangles_overlap"]

_ROUNDING = 1e-9
"""Relief units up to which corners lie in a plane, and stretches are points."""

_TOUCHING = 2e-5
"""Relief units up to which triangles only touch in the picture: twice what float32 rays tell apart."""


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

    def covers(self, one: NDArray[np.int64], other: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Tell whether triangles around two places of the relief cover a part of the picture together.

        Parameters
        ----------
        one, other : (q, 3) int64
            As in `crossed`.

        Returns
        -------
        (q,) bool
            False where they touch at most, or overlap by no more than 2e-5 relief units.
        """
        row, a, b = self._combined(one, other)
        found = triangles_overlap(self._corners[a, :, :2], self._corners[b, :, :2])
        return np.bincount(row, weights=found, minlength=len(one)) > 0

    def meet(
        self,
        one: NDArray[np.int64],
        other: NDArray[np.int64],
        *,
        among: NDArray[np.bool_] | None = None,
    ) -> NDArray[np.bool_]:
        """Tell whether triangles around two places of the relief share a vertex.

        Parameters
        ----------
        one, other : (q, 3) int64
            As in `crossed`.
        among : (n,) bool, optional
            Vertices that count; all of them where omitted.

        Returns
        -------
        (q,) bool
        """
        row, a, b = self._combined(one, other)
        same = self._faces[a][:, :, None] == self._faces[b][:, None, :]
        if among is not None:
            same &= among[self._faces[a]][:, :, None]
        return np.bincount(row, weights=same.any(axis=(1, 2)), minlength=len(one)) > 0

    def _combined(
        self, one: NDArray[np.int64], other: NDArray[np.int64]
    ) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
        """Return all combinations of the triangles at both places: number of the query, both triangles."""
        query, first = self._at(one)
        second_query, second = self._at(other)
        row, column = combined(query, second_query)
        return query[row], first[row], second[column]

    def _at(self, places: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return the triangles that hold all vertices of each place: numbers of places, rising, and faces."""
        around = self._around[places[:, 0]]
        query = np.repeat(np.arange(len(places)), np.diff(around.indptr))
        face = around.indices.astype(np.int64)
        holds = (self._faces[face][:, :, None] == places[query][:, None, :]).any(axis=1).all(axis=1)
        return query[holds], face[holds]


def triangles_cross(one: NDArray[np.float64], other: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Tell which pairs of triangles cross each other, each passing through the other in a common segment.

    Each has corners on both sides of the other's plane, and on the line in which these planes meet both cover
    a common stretch. So edges may pass exactly through edges or corners (Möller 1997).

    Parameters
    ----------
    one, other : (q, 3, 3) float64
        Corners, in relief units.

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
    normals = [_normals(corners) for corners in (one, other)]
    line = _cross(normals[0], normals[1])
    length = np.linalg.norm(line, axis=1, keepdims=True)
    line /= np.where(length > 0.0, length, 1.0)
    middle = other[:, :1]
    begin, end = np.full(len(one), -np.inf), np.full(len(one), np.inf)
    apart = np.ones(len(one), dtype=bool)
    for corners, normal, base in ((one, normals[1], other[:, :1]), (other, normals[0], one[:, :1])):
        height = np.einsum("qck,qk->qc", corners - base, normal)
        height[np.abs(height) <= _ROUNDING] = 0.0
        apart &= (height.min(axis=1) < 0.0) & (height.max(axis=1) > 0.0)
        first, last = _covered(height, np.einsum("qck,qk->qc", corners - middle, line))
        begin, end = np.maximum(begin, first), np.minimum(end, last)
    return np.asarray(apart & (end - begin > _ROUNDING))


def triangles_overlap(one: NDArray[np.float64], other: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Tell which pairs of triangles of the picture overlap by more than a rounding error.

    Convex shapes are apart where a side of one of them has all of the other beyond it.

    Parameters
    ----------
    one, other : (q, 3, 2) float64
        Corners, in relief units.

    Returns
    -------
    (q,) bool
        False up to an overlap of 2e-5 relief units. Three different corners on one line overlap what that
        line passes through, which is on the safe side; two corners in one place overlap nothing.

    Examples
    --------
    >>> corner = np.array([[[0, 0], [4, 0], [0, 4.0]]])
    >>> [bool(triangles_overlap(corner, corner + [x, 0])[0]) for x in (3.0, 4.0, 5.0)]
    [True, False, False]
    """
    apart = np.zeros(len(one), dtype=bool)
    for corners, others in ((one, other), (other, one)):
        side = np.roll(corners, -1, axis=1) - corners
        outwards = np.stack([side[..., 1], -side[..., 0]], axis=2)
        length = np.linalg.norm(outwards, axis=2, keepdims=True)
        outwards = outwards / np.where(length > 0.0, length, 1.0)
        own, far = (np.einsum("qsk,qck->qsc", outwards, some) for some in (corners, others))
        # Whichever way round the corners go: the triangle lies on one side of each of its sides.
        left = own.min(axis=2) - far.max(axis=2), far.min(axis=2) - own.max(axis=2)
        apart |= (np.maximum(*left) >= -_TOUCHING).any(axis=1)
    return np.asarray(~apart)


def _cross(one: NDArray[np.float64], other: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the cross products of vectors, (q, 3) each; np.cross takes three times as long for few."""
    (a, b, c), (d, e, f) = one.T, other.T
    return np.stack([b * f - c * e, c * d - a * f, a * e - b * d], axis=1)


def _normals(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the unit normals of triangles, 0 for those without an area."""
    normal = _cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(normal, axis=1, keepdims=True)
    return np.asarray(normal / np.where(size > 0.0, size, 1.0))


def _covered(
    height: NDArray[np.float64], along: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return where triangles begin and end on a line in a plane, (q,) each.

    `height` and `along`, (q, 3) each, are where their corners lie above that plane and along that line.
    """
    following, next_along = np.roll(height, -1, axis=1), np.roll(along, -1, axis=1)
    passes = height * following <= 0.0
    fall = height - following
    share = height / np.where(fall == 0.0, 1.0, fall)  # an edge in the plane ends at corners of the others
    place = along + share * (next_along - along)
    first = np.where(passes, place, np.inf).min(axis=1)
    return first, np.where(passes, place, -np.inf).max(axis=1)
