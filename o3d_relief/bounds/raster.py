"""What lies above or below what, roughly and fast."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["Raster"]

_CELLS = 256
"""Raster, to each side, on which is looked up what lies above and below what moved."""


class Raster:
    """Boxes of triangles, seen from the front, in cells."""

    def __init__(self, vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> None:
        low, high = vertices[:, :2].min(axis=0), vertices[:, :2].max(axis=0)
        cell = np.ascontiguousarray(((vertices[:, :2] - low) / (high - low + 1e-9) * _CELLS).T).astype(
            np.int64
        )
        a, b, c = (cell[:, corner] for corner in np.ascontiguousarray(faces.T))
        self._first = np.minimum(np.minimum(a, b), c)
        self._last = np.maximum(np.maximum(a, b), c) + 1

    def over_or_under(self, changed: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Find the triangles (m,) that may lie above or below some of them, (m,)."""
        (left, bottom), (right, top) = self._first, self._last
        # Count, in each cell of a raster, the boxes of triangles that changed; then ask for the boxes of all.
        steps = np.zeros((_CELLS + 1, _CELLS + 1), dtype=np.int64)
        for x, y, sign in ((left, bottom, 1), (right, top, 1), (left, top, -1), (right, bottom, -1)):
            np.add.at(steps, (x[changed], y[changed]), sign)
        marked = steps.cumsum(axis=0).cumsum(axis=1)[:-1, :-1] > 0
        total = np.zeros((_CELLS + 1, _CELLS + 1), dtype=np.int64)
        total[1:, 1:] = marked.cumsum(axis=0).cumsum(axis=1)
        within = total[right, top] - total[left, top] - total[right, bottom] + total[left, bottom]
        return np.asarray(within > 0)
