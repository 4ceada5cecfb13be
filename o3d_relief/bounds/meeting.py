"""Edges that cross in the picture."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

__all__ = ["CLEAR", "Boxes", "combinations", "meeting"]

CLEAR = 1e-3
"""Edges cross in the picture where each reaches this far beyond the other, in relief units."""

_BLOCK = 16384
"""Edges that are worked on at once: what lies between stays in the cache of the processor."""


def combinations(
    keys: NDArray[np.int64],
    n: int,
    choose: Callable[[NDArray[np.int64], NDArray[np.int64]], NDArray[np.int64]],
) -> NDArray[np.int64]:
    """Combine the members of each group with each other.

    Parameters
    ----------
    keys : (k,) int64
        n times the group plus the member, in no order.
    n : int
    choose : callable
        Returns which of some combinations to keep: their places in two lists of members.

    Returns
    -------
    (2, q) int64
        Members, some combinations more than once.
    """
    keys = np.sort(keys)
    group, member = np.divmod(keys[np.diff(keys, prepend=-1) > 0], max(n, 1))
    start = np.flatnonzero(np.diff(group, prepend=-1))
    count = np.diff(np.append(start, len(group)))
    found = [np.zeros((2, 0), dtype=np.int64)]
    for size in np.flatnonzero(np.bincount(count)):
        # Groups of one size are a table.
        table = member[start[count == size] + np.arange(size)[:, None]]
        first, second = np.triu_indices(int(size), 1)
        groups = max(_BLOCK // max(len(first), 1), 1)
        for begin in range(0, len(first), _BLOCK):
            rows = slice(begin, begin + _BLOCK)
            for left in range(0, table.shape[1], groups):
                part = table[:, left : left + groups]
                one, other = part[first[rows]].ravel(), part[second[rows]].ravel()
                kept = choose(one, other)
                found.append(np.stack([one[kept], other[kept]]))
    return np.concatenate(found, axis=1)


class Boxes:
    """The boxes of edges in the picture.

    Parameters
    ----------
    ends : (e, 4) float64
        x and y of both ends of each edge.
    """

    def __init__(self, ends: NDArray[np.float64]) -> None:
        begin, end = ends[:, :2], ends[:, 2:]
        # In float32, which only a filter may use: it errs on the safe side.
        self._box = np.concatenate(
            [np.minimum(begin, end), -np.maximum(begin, end)], axis=1, dtype=np.float32
        )
        self._turned = np.ascontiguousarray(self._box[:, [2, 3, 0, 1]])
        self._beyond = np.float32(CLEAR + 4.0 * np.finfo(np.float32).eps * np.abs(ends).max(initial=0.0))

    def near(self, one: NDArray[np.int64], other: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return which edges, of two lists, have boxes that overlap or touch: their places in the lists."""
        beyond = self._box.take(one, axis=0)
        beyond += self._turned.take(other, axis=0)
        x, y, back_x, back_y = (beyond <= self._beyond).T
        return np.asarray(np.flatnonzero(x & y & back_x & back_y))


def meeting(
    ends: NDArray[np.float64], one: NDArray[np.int64], other: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Choose the edges that cross in the picture.

    Parameters
    ----------
    ends : (e, 4) float64
        x and y of both ends of each edge.
    one, other : (q,) int64
        Edges that may cross, some twice.

    Returns
    -------
    one, other : (c,) int64
        Those that do, each two once, in rising order.
    share, other_share : (c,) float64
        Where, as shares of both.
    """
    found = []
    for begin in range(0, len(one) or 1, _BLOCK):
        block = slice(begin, begin + _BLOCK)
        first, second = one[block], other[block]
        of_one, of_other = ends.take(first, axis=0).T, ends.take(second, axis=0).T
        met, share = _met(of_one, of_other)
        back, other_share = _met(of_other[:, met], of_one[:, met])
        met = met[back]
        found.append((first[met], second[met], share[back], other_share))
    one, other, share, other_share = (np.concatenate(parts) for parts in zip(*found, strict=True))
    _, once = np.unique(one * len(ends) + other, return_index=True)
    return one[once], other[once], share[once], other_share[once]


def _met(
    ends: NDArray[np.float64], others: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Choose edges, (4, q), whose ends lie clearly on both sides of others; return where they meet these."""
    x, y, far_x, far_y = others
    along_x, along_y = far_x - x, far_y - y
    first, second = (along_x * (ends[tip + 1] - y) - along_y * (ends[tip] - x) for tip in (0, 2))
    apart = np.flatnonzero(first * second < 0.0)
    first, second = first[apart], second[apart]
    length = np.sqrt(along_x[apart] ** 2 + along_y[apart] ** 2)
    clear = np.flatnonzero(np.minimum(np.abs(first), np.abs(second)) > CLEAR * length)
    return apart[clear], first[clear] / (first[clear] - second[clear])
