"""Lists of different lengths in one array."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["combined"]


def combined(one: NDArray[np.int64], other: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Combine each item of some lists with each of others of the same numbers.

    Parameters
    ----------
    one, other : (p,) and (q,) int64
        The number of the list that each item is in, from 0, rising.

    Returns
    -------
    first, second : (r,) int64
        Places in `one` and in `other`.

    Examples
    --------
    >>> first, second = combined(np.array([0, 0, 2]), np.array([0, 1, 2, 2]))
    >>> first.tolist(), second.tolist()
    ([0, 1, 2, 2], [0, 0, 2, 3])
    """
    count = np.bincount(other, minlength=int(one.max(initial=-1)) + 1)
    times, begin = count[one], (np.cumsum(count) - count)[one]
    first = np.repeat(np.arange(len(one)), times)
    return first, begin[first] + np.arange(len(first)) - (np.cumsum(times) - times)[first]
