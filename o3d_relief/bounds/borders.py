"""Where a surface ends."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["SAME_PLACE", "Borders"]

SAME_PLACE = 5e-4
"""Points of a line that are closer than this, in relief units, are one: rays are cast in float32."""


class Borders:
    """The borders of a mesh, seen from the front: a line that grazes one meets the surface by chance."""

    def __init__(self, vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> None:
        n = len(vertices)
        self._faces, self._vertices = faces, vertices
        corners = np.ascontiguousarray(faces.T)
        # Only edges of one face have both ends where the faces around do not close up.
        open_ = _open(corners, n)
        likely = faces[np.count_nonzero(open_[faces], axis=1) > 1].T if open_.any() else corners[:, :0]
        start, end = likely[[1, 2, 0]], likely[[2, 0, 1]]
        both = open_[start] & open_[end]
        ordered = np.sort(np.minimum(start, end)[both] * n + np.maximum(start, end)[both])
        alone = np.ones(len(ordered), dtype=bool)
        same = ordered[1:] == ordered[:-1]
        alone[1:] &= ~same
        alone[:-1] &= ~same
        self._single = ordered[alone]
        self._at_border = np.zeros(n, dtype=bool)
        self._at_border[self._single // n] = True
        self._at_border[self._single % n] = True

    def grazed(self, triangle: NDArray[np.int64], weights: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Tell which points of triangles, (q,) and (q, 3), lie on a border, to a rounding error."""
        grazed = np.zeros(len(triangle), dtype=bool)
        if len(self._single) == 0:
            return grazed
        a, b, c = (self._at_border[corner] for corner in self._faces.take(triangle, axis=0).T)
        likely = np.flatnonzero(a | b | c)
        corners, near = self._near_sides(triangle[likely], weights[likely])
        at_side = near.any(axis=0)
        grazed[likely[at_side]] = self._at_borders(corners[:, at_side], near[:, at_side])
        return grazed

    def _near_sides(
        self, triangle: NDArray[np.int64], weights: NDArray[np.float64]
    ) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """Return the corners of triangles, (3, q), and to which of their sides points are close, (3, q)."""
        corners = np.ascontiguousarray(self._faces.take(triangle, axis=0).T)
        x, y = (at.reshape(corners.shape) for at in self._vertices.take(corners.ravel(), axis=0).T[:2])
        across, along = x[[2, 0, 1]] - x[[1, 2, 0]], y[[2, 0, 1]] - y[[1, 2, 0]]
        area = np.abs(across[0] * along[1] - along[0] * across[1])
        height = area / np.maximum(np.sqrt(across**2 + along**2), np.finfo(np.float64).tiny)
        return corners, weights.T * height < 2 * SAME_PLACE

    def _at_borders(self, corners: NDArray[np.int64], near: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Tell which points (q,) that are close to some sides of their triangles, (3, q), are at a border."""
        start, end = corners[[1, 2, 0]], corners[[2, 0, 1]]
        corner_on_border = self._at_border[corners]
        likely = near & corner_on_border[[1, 2, 0]] & corner_on_border[[2, 0, 1]]
        start, end = start[likely], end[likely]
        edge = np.minimum(start, end) * len(self._vertices) + np.maximum(start, end)
        place = np.minimum(np.searchsorted(self._single, edge), len(self._single) - 1)
        on_border = np.zeros(likely.shape, dtype=bool)
        on_border[likely] = self._single[place] == edge
        found = np.zeros(corners.shape[1], dtype=bool)
        for side in range(3):
            found |= on_border[side]
            found |= near[side - 2] & near[side - 1] & corner_on_border[side]
        return found


def _open(corners: NDArray[np.int64], n: int) -> NDArray[np.bool_]:
    """Find the vertices around which faces, (3, m), do not close up, or turn different ways, (n,).

    Around other vertices each neighbour comes first in a face as often as it comes last: of large random
    numbers of the neighbours, added and taken off, nothing is left.
    """
    number = np.random.default_rng(0).integers(1, 1 << 40, n).astype(np.float64)  # sums of them are exact
    a, b, c = (number[corner] for corner in corners)
    left = np.zeros(n)
    for corner, change in zip(corners, (b - c, c - a, a - b), strict=True):
        left += np.bincount(corner, weights=change, minlength=n)
    return np.asarray(left != 0.0)
