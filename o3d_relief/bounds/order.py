"""Surfaces keep their order along every vertical line, and what is visible stays in front of S."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from o3d_relief.bounds.pairs import Pairs
from o3d_relief.linalg.solve import solve_spd

__all__ = ["Ordered", "keep_order", "out_of_order"]

_REACH = 8.0
"""Distance in relief units over which a correction fades out."""

_REGION = 3.0
"""What lies further from every correction than this many reaches is not touched."""

_MARGIN = 0.2
_FIRST_WEIGHT = 1.0
_GROWTH = 4.0
_ROUNDS = 24


@dataclass(frozen=True, kw_only=True, eq=False)
class Ordered:
    """Heights in order.

    Attributes
    ----------
    z : (n,) float64
    rounds : int
        Linear systems solved.
    corrected_pairs : int
        Pairs that had to be kept apart.
    left : int
        Pairs that are still out of order, and visible vertices still behind S.
    """

    z: NDArray[np.float64]
    rounds: int
    corrected_pairs: int
    left: int


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
    return (upper - lower < required_gaps(pairs, min_gap)) & (np.maximum(upper, lower) > 0.0)


def keep_order(
    vertices: NDArray[np.float64],
    laplacian: sp.csr_array,
    areas: NDArray[np.float64],
    z: NDArray[np.float64],
    pair_sets: list[Pairs],
    *,
    in_front: NDArray[np.bool_] | None = None,
    min_gap: float = 0.0,
) -> Ordered:
    """Correct heights until no pair is out of order and nothing visible lies behind S.

    minimise  e' C e + sum of A_i e_i^2 / reach^2   subject to  gap + R (z + e - z_0) >= required gap
    for every pair, and z_i + e_i >= 0 for the vertices in front. The original scene fulfils every
    constraint, so there is always a solution. Each constraint that is violated becomes a spring that pulls
    to a little beyond its bound, and a spring whose constraint is still violated gets four times as stiff.

    Parameters
    ----------
    vertices : (n, 3) float64
        Original positions.
    laplacian : (n, n) sparse float64
        C.
    areas : (n,) float64
        Area of each vertex.
    z : (n,) float64
        Heights to correct.
    pair_sets : list of Pairs
        Kept in order one after the other: the later ones count once the earlier ones are in order.
    in_front : (n,) bool, optional
        Vertices that must not end behind S.
    min_gap : float
        In relief units.

    Returns
    -------
    Ordered
    """
    front = np.zeros(len(z), dtype=bool) if in_front is None else in_front
    system = _Springs(laplacian, areas, vertices)
    current, rounds = z, 0
    active: list[Pairs] = []
    stiffness: list[NDArray[np.float64]] = []
    floor = np.zeros(len(z))
    for number, pairs in enumerate(pair_sets):
        active.append(pairs.select(np.zeros(len(pairs), dtype=bool)))
        stiffness.append(np.zeros(len(pairs)))
        while rounds < _ROUNDS:
            worst = False
            for k in range(number + 1):
                bad = out_of_order(pair_sets[k], current, min_gap=min_gap)
                stiffness[k] = np.where(bad, np.maximum(stiffness[k] * _GROWTH, _FIRST_WEIGHT), stiffness[k])
                worst |= bool(bad.any())
            behind = front & (current < 0.0)
            floor = np.where(behind, np.maximum(floor * _GROWTH, _FIRST_WEIGHT), floor)
            if not worst and not behind.any():
                break
            chosen = Pairs.join([pair_sets[k].select(stiffness[k] > 0) for k in range(number + 1)])
            weights = np.concatenate([stiffness[k][stiffness[k] > 0] for k in range(number + 1)])
            current = system.solve(z, chosen, weights, floor, min_gap)
            rounds += 1
    left = sum(int(out_of_order(pairs, current, min_gap=min_gap).sum()) for pairs in pair_sets)
    left += int((front & (current < 0.0)).sum())
    corrected = sum(int((s > 0).sum()) for s in stiffness)
    return Ordered(z=current, rounds=rounds, corrected_pairs=corrected, left=left)


class _Springs:
    """The quadratic form of the correction, and springs on pairs and on single vertices."""

    def __init__(
        self, laplacian: sp.csr_array, areas: NDArray[np.float64], vertices: NDArray[np.float64]
    ) -> None:
        self._form = (laplacian + sp.diags_array(areas / _REACH**2)).tocsr()
        self._vertices = vertices

    def solve(
        self,
        z: NDArray[np.float64],
        pairs: Pairs,
        weights: NDArray[np.float64],
        floor: NDArray[np.float64],
        min_gap: float,
    ) -> NDArray[np.float64]:
        required = required_gaps(pairs, min_gap)
        target = required + np.minimum((pairs.gap - required) / 4.0, _MARGIN)
        upper, lower = pairs.heights(z)
        rows = pairs.difference(len(z))
        pull: NDArray[np.float64] = rows.T @ (weights * (target - (upper - lower)))
        pull = pull + floor * (np.minimum(self._vertices[:, 2], _MARGIN / 10) - z)
        touched = np.unique(np.concatenate([pairs.upper.ravel(), pairs.lower.ravel(), np.flatnonzero(floor)]))
        distance, _ = cKDTree(self._vertices[touched]).query(
            self._vertices, distance_upper_bound=_REGION * _REACH
        )
        free = np.flatnonzero(np.isfinite(distance))
        matrix = (self._form + rows.T @ sp.diags_array(weights) @ rows + sp.diags_array(floor)).tocsr()
        result = z.copy()
        result[free] += solve_spd(matrix[free][:, free].tocsr(), np.asarray(pull)[free], tolerance=1e-7)
        return result
