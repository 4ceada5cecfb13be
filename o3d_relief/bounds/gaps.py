"""The gaps of pairs of surfaces: what they must keep, and which of them do not."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from o3d_relief.bounds.pairs import Pairs

__all__ = ["EXACT", "out_of_order", "required_gaps", "spare", "wanted_gaps", "worst_of_stacks"]

_MARGIN = 0.05
"""Pairs are set this far beyond their smallest gap, or a quarter of what they have, if that is less."""

EXACT = 1e-4
"""Relief units by which a gap may miss: well below what float32 rays tell apart."""

_SLACK = 0.01
"""Relief units beyond what they are set to from which on pairs have room to spare."""


def required_gaps(pairs: Pairs, min_gap: float) -> NDArray[np.float64]:
    """Return the gap that each pair must keep, (p,): the minimum, or its own where that is smaller."""
    return np.minimum(pairs.gap, min_gap)


def out_of_order(pairs: Pairs, z: NDArray[np.float64], *, min_gap: float = 0.0) -> NDArray[np.bool_]:
    """Find the pairs that are out of order, or closer than they must be.

    Parameters
    ----------
    pairs : Pairs
    z : (n,) float64
        Heights after.
    min_gap : float
        Smallest gap that pairs keep, if theirs was not smaller before.

    Returns
    -------
    (p,) bool
        Pairs of which both points lie behind S, where they are cut off, do not count.
    """
    upper, lower = pairs.heights(z)
    missed = upper - lower < required_gaps(pairs, min_gap) - EXACT
    return missed & (np.maximum(upper, lower) > 0.0)


def wanted_gaps(pairs: Pairs, min_gap: float) -> NDArray[np.float64]:
    """Return the gap that pairs are set to: a little more than they must keep, and less than they had."""
    required = required_gaps(pairs, min_gap)
    return np.asarray(required + np.minimum((pairs.gap - required) / 4.0, _MARGIN))


def spare(pairs: Pairs, z: NDArray[np.float64], min_gap: float) -> NDArray[np.bool_]:
    """Find the pairs that are further apart than they are set to."""
    upper, lower = pairs.heights(z)
    return np.asarray(upper - lower > wanted_gaps(pairs, min_gap) + _SLACK)


def worst_of_stacks(
    pairs: Pairs, lacking: NDArray[np.float64], wrong: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Find, of each two triangles above each other, the wrong pair that lacks most of what it must keep.

    A gap is linear over two triangles: hundreds of grid lines through them say hardly more than one.

    Parameters
    ----------
    pairs : Pairs
    lacking : (p,) float64
    wrong : (p,) bool

    Returns
    -------
    (p,) bool
    """
    among = pairs.select(wrong)
    stack = np.concatenate([among.upper, among.lower], axis=1)
    order = np.lexsort((-lacking[wrong], *stack.T))
    first = np.ones(len(order), dtype=bool)
    first[1:] = (stack[order][1:] != stack[order][:-1]).any(axis=1)
    worst = np.zeros(len(pairs), dtype=bool)
    worst[np.flatnonzero(wrong)[order[first]]] = True
    return worst
