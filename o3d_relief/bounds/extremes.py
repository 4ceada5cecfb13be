"""Of the lines that pass through the same two triangles, those that matter."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from o3d_relief.bounds.pairs import Pairs

__all__ = ["extreme_pairs"]

_DIRECTIONS = np.array([[1, 0], [0, 1], [1, 1], [1, -1]])
"""Directions in which lines of a grid follow each other."""


def extreme_pairs(pairs: Pairs, plane: NDArray[np.float64], *, side: int = 1024) -> Pairs:
    """Leave out the pairs of a regular grid that lie between others of the same two triangles.

    The gap between two triangles is linear in x and y: between two lines on which it is at least a linear
    bound, it is so, too.

    Parameters
    ----------
    pairs : Pairs
        From `grid_pairs`.
    plane : (n, 2) float64
        x and y of the vertices, which the grid covers.
    side : int
        Number of lines along x and along y.

    Returns
    -------
    Pairs

    Examples
    --------
    Five lines in a row through the same two triangles, of which the outer two are enough:

    >>> plane = np.array([[0.0, 0.0], [5.0, 0.0], [0.0, 5.0]])
    >>> x = (np.arange(5) + 0.5) / 5
    >>> weights = np.stack([0.9 - x, x, np.full(5, 0.1)], axis=1)
    >>> corners = np.tile([0, 1, 2], (5, 1))
    >>> row = Pairs(upper=corners, upper_weights=weights, lower=corners, lower_weights=weights, gap=x)
    >>> extreme_pairs(row, plane, side=5).gap.tolist()
    [0.1, 0.9]
    """
    crowded = _crowded(pairs)
    alone, pairs = pairs.select(~crowded), pairs.select(crowded)
    low, extent = plane.min(axis=0), np.ptp(plane, axis=0)
    place = np.einsum("pck,pc->pk", plane[pairs.upper], pairs.upper_weights)
    line = np.rint((place - low) / np.where(extent > 0.0, extent, 1.0) * side - 0.5).astype(np.int64)
    group = _groups(pairs, len(plane))
    kept = np.arange(len(pairs))
    for along in _DIRECTIONS:
        across = np.array([-along[1], along[0]])
        row, position = line[kept] @ across, line[kept] @ along
        order = np.lexsort((position, row, group[kept]))
        same = (np.diff(group[kept][order]) == 0) & (np.diff(row[order]) == 0)
        between = np.zeros(len(kept), dtype=bool)
        between[1:-1] = same[:-1] & same[1:]
        kept = np.sort(kept[order[~between]])
    return Pairs.join([alone, pairs.select(kept)])


def _crowded(pairs: Pairs) -> NDArray[np.bool_]:
    """Tell which pairs may share their triangles with two others, (p,): others lie between none."""
    corners = np.concatenate([pairs.upper, pairs.lower], axis=1).astype(np.uint64)
    factors = np.random.default_rng(0).integers(1, 2**63, 6, dtype=np.uint64)
    key = np.zeros(len(pairs), dtype=np.uint64)  # numbers that may be the same by chance
    for corner, factor in zip(corners.T, factors, strict=True):
        key += corner * factor
    order = np.argsort(key, kind="stable")
    ordered = key[order]
    first = np.searchsorted(ordered, ordered, side="left")
    crowded = np.zeros(len(pairs), dtype=bool)
    crowded[order] = np.bincount(first, minlength=len(pairs))[first] > 2
    return crowded


def _groups(pairs: Pairs, n: int) -> NDArray[np.int64]:
    """Give numbers to the combinations of an upper and a lower triangle, (p,)."""
    upper, lower = (
        np.unique(corners @ np.array([n * n, n, 1]), return_inverse=True)[1]
        for corners in (pairs.upper, pairs.lower)
    )
    return np.asarray(upper.ravel() * len(pairs) + lower.ravel(), dtype=np.int64)
