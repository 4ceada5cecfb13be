"""Normals of points: estimated from their neighbours, or the cloud's own once they are checked."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from o3d_relief.progress import Tick, silent
from o3d_relief.scan.neighbours import Neighbours

__all__ = ["agreement", "check_normals", "estimate_normals"]

_BLOCK = 100_000
"""Points at a time, to bound memory."""

_ALONG = 0.7
"""Normals that lie within 45 degrees of the estimated ones, either way round, agree with them."""


def estimate_normals(
    points: NDArray[np.float64],
    neighbours: Neighbours,
    usable: NDArray[np.bool_],
    *,
    tick: Tick = silent,
) -> NDArray[np.float64]:
    """Estimate normals: the direction in which a point and its neighbours spread least.

    Parameters
    ----------
    points : (n, 3) float64
        Near the origin compared with their spacing, or rounding errors show.
    neighbours : Neighbours
    usable : (n,) bool
        Points that count; the others are no neighbours and get the normal zero.
    tick : callable, optional
        Called with the share of the work that is done; it may raise to end the work.

    Returns
    -------
    (n, 3) float64
        Unit vectors, pointing either way; zero where fewer than three points in a triangle are left.

    Examples
    --------
    >>> from o3d_relief.scan.neighbours import find_neighbours
    >>> flat = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.0]])
    >>> np.abs(estimate_normals(flat, find_neighbours(flat), np.ones(4, dtype=bool))[0]).tolist()
    [0.0, 0.0, 1.0]
    """
    normals = np.zeros_like(points)
    for start in range(0, len(points), _BLOCK):
        tick(start / len(points))
        block = slice(start, start + _BLOCK)
        index = np.column_stack([np.arange(len(points))[block], neighbours.index[block]])
        weight = usable[index].astype(np.float64)
        total = np.maximum(weight.sum(axis=1), 1.0)
        near = points[index]
        near -= (np.einsum("nk,nkj->nj", weight, near) / total[:, None])[:, None]
        value, vector = np.linalg.eigh(np.einsum("nk,nki,nkj->nij", weight, near, near, optimize=True))
        # Points on a line have no plane.
        spread = usable[block] & (value[:, 1] > 1e-9 * value[:, 2])
        normals[block][spread] = vector[spread, :, 0]
    return normals


def check_normals(normals: NDArray[np.float64] | None, length: int) -> NDArray[np.float64] | None:
    """Bring the normals of a cloud to unit length.

    Parameters
    ----------
    normals : (n, 3) float64 or None
    length : int
        The number of points.

    Returns
    -------
    (n, 3) float64 or None
        Zero where one is zero or not finite; None where there are none, or not one for each point.
    """
    if normals is None or len(normals) != length:
        return None
    finite = np.where(np.isfinite(normals).all(axis=1, keepdims=True), normals, 0.0)
    largest = np.abs(finite).max(axis=1, keepdims=True)
    scaled = finite / np.where(largest > 0.0, largest, 1.0)  # squares must neither overflow nor vanish
    size = np.linalg.norm(scaled, axis=1, keepdims=True)
    return np.asarray(scaled / np.where(size > 0.0, size, 1.0))


def agreement(normals: NDArray[np.float64], estimated: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Find the normals that lie within 45 degrees of the estimated ones, either way round.

    Parameters
    ----------
    normals, estimated : (n, 3) float64
        Unit vectors or zero.

    Returns
    -------
    (n,) bool

    Examples
    --------
    >>> agreement(np.array([[0, 0, -1.0], [1, 0, 0]]), np.array([[0, 0, 1.0], [0, 0, 1]])).tolist()
    [True, False]
    """
    return np.asarray(np.abs((normals * estimated).sum(axis=1)) >= _ALONG)
