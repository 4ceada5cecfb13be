"""Pairs as rows of a matrix."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from o3d_relief.bounds.pairs import Pairs

__all__ = ["gap_rows", "point_rows"]


def gap_rows(pairs: Pairs, n: int) -> sp.csr_array:
    """Return the matrix R, (p, n), with which R z is the height of the upper less that of the lower.

    Like `Pairs.difference`, but without sorting the entries: there may be a million pairs.
    """
    columns = np.concatenate([pairs.upper, pairs.lower], axis=1)
    values = np.concatenate([pairs.upper_weights, -pairs.lower_weights], axis=1)
    return _rows(columns, values, n)


def point_rows(corners: NDArray[np.int64], weights: NDArray[np.float64], n: int) -> sp.csr_array:
    """Return the matrix (p, n) with which vertex heights (n,) give those of points of triangles.

    Parameters
    ----------
    corners : (p, 3) int64
    weights : (p, 3) float64
        Barycentric coordinates.
    n : int

    Returns
    -------
    (p, n) sparse float64

    Examples
    --------
    >>> middle = point_rows(np.array([[0, 2, 1]]), np.array([[0.5, 0.5, 0.0]]), 3)
    >>> (middle @ np.array([1.0, 7.0, 4.0])).tolist()
    [2.5]
    """
    return _rows(corners, weights, n)


def _rows(columns: NDArray[np.int64], values: NDArray[np.float64], n: int) -> sp.csr_array:
    """Return a matrix (p, n) of rows with as many entries each: their columns and values, (p, w)."""
    count, width = columns.shape
    starts = np.arange(count + 1, dtype=np.int64) * width
    kind = np.int32 if max(count * width, n) < 2**31 else np.int64
    parts = values.ravel(), columns.ravel().astype(kind), starts.astype(kind)
    return sp.csr_array(parts, shape=(count, n))
