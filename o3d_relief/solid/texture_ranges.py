"""How much a texture changes within a rectangle, without looking at all of its pixels."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["Ranges"]


class Ranges:
    """Least and greatest values of a texture in squares of 1, 2, 4, ... pixels.

    Parameters
    ----------
    texture : (h, w, 3) uint8
        Row 0 lies at v = 0.

    Examples
    --------
    >>> ramp = np.repeat(np.arange(4, dtype=np.uint8)[None, :, None] * 50, 3, axis=2)
    >>> Ranges(ramp).within(np.array([[0.0, 0.0]]), np.array([[0.2, 1.0]])).tolist()
    [50]
    """

    def __init__(self, texture: NDArray[np.uint8]) -> None:
        self._shape = texture.shape[:2]
        self._levels = [(texture, texture)]
        while max(self._levels[-1][0].shape[:2]) > 1:
            low, high = self._levels[-1]
            rows, columns = (length % 2 for length in low.shape[:2])
            pad = ((0, rows), (0, columns), (0, 0))
            low, high = np.pad(low, pad, mode="edge"), np.pad(high, pad, mode="edge")
            self._levels.append((_pooled(low, np.minimum), _pooled(high, np.maximum)))

    def within(self, low: NDArray[np.float64], high: NDArray[np.float64]) -> NDArray[np.int64]:
        """Return the largest change of a channel within rectangles and a pixel around them.

        It is never less than the true one.

        Parameters
        ----------
        low, high : (n, 2) float64
            Least and greatest u and v; textures repeat.

        Returns
        -------
        (n,) int64
            From 0 to 255.
        """
        height, width = self._shape
        size = np.array([width, height])
        first = np.floor(np.mod(low, 1.0) * size).astype(np.int64)
        last = np.ceil((np.mod(low, 1.0) + (high - low)) * size).astype(np.int64) - 1
        last = np.maximum(last, first)
        # Rectangles over the edge of the texture are taken as all of it.
        wide = (last >= size).any(axis=1)
        first, last = np.maximum(first - 1, 0), np.minimum(last + 1, size - 1)
        first[wide], last[wide] = 0, size - 1
        extent = np.maximum((last - first).max(axis=1), 1)
        # Squares so large that two of them cover the rectangle along each axis.
        level = np.minimum(np.ceil(np.log2(extent)).astype(np.int64), len(self._levels) - 1)
        result = np.zeros(len(low), dtype=np.int64)
        for number in np.unique(level):
            mine = level == number
            least, greatest = self._levels[number]
            columns = np.stack([first[mine, 0], last[mine, 0]]) >> number
            rows = np.stack([first[mine, 1], last[mine, 1]]) >> number
            bottom = least[rows[:, None], columns[None, :]].min(axis=(0, 1)).astype(np.int64)
            top = greatest[rows[:, None], columns[None, :]].max(axis=(0, 1)).astype(np.int64)
            result[mine] = (top - bottom).max(axis=1)
        return result


def _pooled(values: NDArray[np.uint8], how: np.ufunc) -> NDArray[np.uint8]:
    pairs = how(values[::2], values[1::2])
    return np.asarray(how(pairs[:, ::2], pairs[:, 1::2]))
