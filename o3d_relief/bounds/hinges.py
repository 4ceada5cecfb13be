"""Surfaces that changed places behind S, but hang together in front of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from o3d_relief.bounds.origin import Origin
from o3d_relief.bounds.pairs import Pairs

__all__ = ["hinged_pairs"]

_EXACT = 1e-4
"""Relief units by which a gap may be below 0."""


def hinged_pairs(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], pairs: Pairs, z: NDArray[np.float64]
) -> Pairs:
    """Choose the pairs out of order behind S whose triangles have a common vertex in front of it.

    From that vertex, where they meet, to the line of the pair the gap of the two triangles is linear: if they
    changed places on that line, behind S, they did so from the vertex on, in front of S.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int64
    pairs : Pairs
    z : (n,) float64
        Heights now.

    Returns
    -------
    Pairs

    Examples
    --------
    Two triangles with a common corner, and a corner of the one above the middle of the other:

    >>> places = np.array([[0, 0, 0], [4, 0, 2], [4, 4, 2], [3, 1, 4], [0, 4, 1.0]])
    >>> corner, middle = np.array([[1.0, 0, 0]]), np.array([[0.25, 0.5, 0.25]])
    >>> pair = Pairs(
    ...     upper=np.array([[3, 3, 3]]), upper_weights=corner,
    ...     lower=np.array([[0, 1, 2]]), lower_weights=middle, gap=np.array([2.5]),
    ... )
    >>> turned = np.array([1.0, -1.0, -1.0, -4.0, -1.0])
    >>> len(hinged_pairs(places, np.array([[0, 1, 2], [0, 3, 4]]), pair, turned))
    1
    """
    if len(pairs) == 0:
        return pairs
    front = z > 0.0
    one, two, three = front[faces].T
    cut = faces[(one != two) | (two != three)]
    beside = np.zeros(len(z), dtype=bool)
    beside[cut] = True
    likely = np.flatnonzero(beside[pairs.upper[:, 0]] & beside[pairs.lower[:, 0]])
    chosen = pairs.select(likely)
    chosen = chosen.select(
        np.flatnonzero(beside[chosen.upper].all(axis=1) & beside[chosen.lower].all(axis=1))
    )
    upper, lower = chosen.heights(z)
    chosen = chosen.select((upper - lower < -_EXACT) & (lower <= 0.0))
    above = _holding(chosen.upper, chosen.upper_weights)
    below = _holding(chosen.lower, chosen.lower_weights)
    return chosen.select(Origin(cut, cut, vertices).meet(above, below, among=front))


def _holding(corners: NDArray[np.int64], weights: NDArray[np.float64]) -> NDArray[np.int64]:
    """Write points as the corners that hold them, (p, 3): those without weight are others, again."""
    heaviest = np.take_along_axis(corners, weights.argmax(axis=1)[:, None], axis=1)
    return np.where(weights == 0.0, heaviest, corners)
