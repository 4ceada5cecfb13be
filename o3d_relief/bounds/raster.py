"""What lies above or below what, roughly and fast."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["Raster"]

_CELLS = 256
"""Raster, to each side, on which is looked up what lies above and below what moved."""

_WIDE = _CELLS + 1


class Raster:
    """Boxes of triangles, seen from the front, in cells."""

    def __init__(self, vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> None:
        low, high = vertices[:, :2].min(axis=0), vertices[:, :2].max(axis=0)
        cell = np.ascontiguousarray(((vertices[:, :2] - low) / (high - low + 1e-9) * _CELLS).T).astype(
            np.int32
        )
        a, b, c = (cell[:, corner] for corner in np.ascontiguousarray(faces.T))
        (left, bottom), (right, top) = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c) + 1
        # Both corners of each box, and the other two, in a raster of one cell more.
        self._plus = left * _WIDE + bottom, right * _WIDE + top
        self._minus = left * _WIDE + top, right * _WIDE + bottom

    def over_or_under(self, changed: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Find the triangles (m,) that may lie above or below some of them, (m,)."""
        chosen = np.flatnonzero(changed)
        # Count, in each cell of a raster, the boxes of triangles that changed; then ask for the boxes of all.
        more, less = (
            np.bincount(np.concatenate([corner.take(chosen) for corner in corners]), minlength=_WIDE * _WIDE)
            for corners in (self._plus, self._minus)
        )
        steps = (more - less).astype(np.int32).reshape(_WIDE, _WIDE)
        marked = _summed(steps)[:-1, :-1] > 0
        total = np.zeros((_WIDE, _WIDE), dtype=np.int32)
        total[1:, 1:] = _summed(marked)
        flat = total.ravel()
        within = flat.take(self._plus[0]) + flat.take(self._plus[1])
        within -= flat.take(self._minus[0])
        within -= flat.take(self._minus[1])
        return np.asarray(within > 0)


def _summed(cells: NDArray[np.generic]) -> NDArray[np.int32]:
    """Return the sums over all cells of a raster that are not further along x and y; int32 is faster."""
    return np.asarray(np.cumsum(np.cumsum(cells, axis=0, dtype=np.int32), axis=1, dtype=np.int32))
