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

_REACH = 4.0
"""Distance over which a correction fades out, in multiples of its size: slopes change by a quarter."""

_SHORTEST, _LONGEST = 1.5, 8.0
"""The same in relief units, at least and at most."""

_REGION = 3.0
"""What lies further from every correction than this many reaches is not touched."""

_MARGIN = 0.2
_FIRST_STIFFNESS = 10.0
_GROWTH = 4.0
_STIFFEST = 1e3
_STIFFEST_OF_THE_LAST = 1e6
_PATIENCE = 10
"""Very stiff springs make the systems hard to solve: only the few that are still wrong after this many
rounds become so."""

_PROGRESS = 0.9
_WITHOUT_PROGRESS = 4
"""After so many rounds that did not lower what is left to this share of it, the best so far is taken."""


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
    pairs: Pairs,
    *,
    in_front: NDArray[np.bool_] | None = None,
    min_gap: float = 0.0,
) -> Ordered:
    """Correct heights until no pair is out of order and nothing visible lies behind S.

    minimise  e' C e + sum of A_i e_i^2 / reach^2   subject to  gap + R (z + e - z_0) >= required gap
    for every pair, and z_i + e_i >= 0 for the vertices in front. The original scene fulfils every
    constraint, so there is always a solution. Each constraint that is violated becomes a one-sided spring
    that pulls to a little beyond its bound; one that is still violated gets stiffer and aims further (the
    method of multipliers).

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
    pairs : Pairs
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
    on_pairs, on_floor = _Multipliers(len(pairs)), _Multipliers(len(z))
    wanted, wanted_height = _wanted_gaps(pairs, min_gap), np.full(len(z), _MARGIN / 10)
    current, rounds = z, 0
    best, fewest, best_round = z, len(pairs) + len(z) + 1, 0
    while True:
        wrong = out_of_order(pairs, current, min_gap=min_gap)
        behind = front & (current < 0.0)
        left = int(wrong.sum()) + int(behind.sum())
        if left <= _PROGRESS * fewest:
            best_round = rounds
        if left < fewest:
            best, fewest = current, left
        if left == 0 or rounds - best_round >= _WITHOUT_PROGRESS:
            break
        upper, lower = pairs.heights(current)
        stiffest = _STIFFEST if rounds < _PATIENCE else _STIFFEST_OF_THE_LAST
        springs = on_pairs.update(wrong, wanted - (upper - lower), stiffest)
        lifts = on_floor.update(behind, wanted_height - current, stiffest)
        current = system.solve(
            z,
            pairs.select(springs),
            on_pairs.stiffness[springs],
            (wanted + on_pairs.further)[springs],
            np.where(lifts, on_floor.stiffness, 0.0),
            wanted_height + on_floor.further,
        )
        rounds += 1
    corrected = int((on_pairs.stiffness > 0.0).sum())
    return Ordered(z=best, rounds=rounds, corrected_pairs=corrected, left=fewest)


class _Multipliers:
    """The forces of one-sided springs: the method of multipliers (an augmented Lagrangian)."""

    def __init__(self, count: int) -> None:
        self.stiffness = np.zeros(count)
        self.force = np.zeros(count)

    def update(
        self, wrong: NDArray[np.bool_], missing: NDArray[np.float64], stiffest: float
    ) -> NDArray[np.bool_]:
        """Return which springs act next, given what is wrong and what each lacks of what is wanted.

        What a spring could not hold is added to its force; one whose force would pull lets go; one that is
        still wrong gets stiffer.
        """
        self.force = np.maximum(self.force + self.stiffness * missing, 0.0)
        self.stiffness[wrong] = np.clip(self.stiffness[wrong] * _GROWTH, _FIRST_STIFFNESS, stiffest)
        return (self.stiffness > 0.0) & ((self.force > 0.0) | (missing > 0.0))

    @property
    def further(self) -> NDArray[np.float64]:
        """How far beyond what is wanted each spring aims."""
        return self.force / np.maximum(self.stiffness, _FIRST_STIFFNESS)


def _wanted_gaps(pairs: Pairs, min_gap: float) -> NDArray[np.float64]:
    """Return the gap that a spring pulls to: a little more than it must keep, and less than it was."""
    required = required_gaps(pairs, min_gap)
    return np.asarray(required + np.minimum((pairs.gap - required) / 4.0, _MARGIN))


class _Springs:
    """The quadratic form of the correction, and springs on pairs and on single vertices."""

    def __init__(
        self, laplacian: sp.csr_array, areas: NDArray[np.float64], vertices: NDArray[np.float64]
    ) -> None:
        self._laplacian = laplacian
        self._areas = areas
        self._vertices = vertices
        self._size = np.zeros(len(vertices))

    def solve(
        self,
        z: NDArray[np.float64],
        pairs: Pairs,
        weights: NDArray[np.float64],
        target: NDArray[np.float64],
        floor: NDArray[np.float64],
        floor_target: NDArray[np.float64],
    ) -> NDArray[np.float64]:
        upper, lower = pairs.heights(z)
        missing = target - (upper - lower)
        lift = np.where(floor > 0.0, floor_target - z, 0.0)
        free, reach = self._region(pairs, missing, lift)

        rows = pairs.difference(len(z))[:, free]
        pull = rows.T @ (weights * missing) + floor[free] * lift[free]
        form = self._laplacian[free][:, free] + rows.T @ sp.diags_array(weights) @ rows
        form = form + sp.diags_array(self._areas[free] / reach**2 + floor[free])
        result: NDArray[np.float64] = z.copy()
        result[free] += solve_spd(form.tocsr(), np.asarray(pull), tolerance=1e-7)
        return result

    def _region(
        self,
        pairs: Pairs,
        missing: NDArray[np.float64],
        lift: NDArray[np.float64],
    ) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Return the vertices that a correction may move, and how far it reaches at each of them.

        Both only grow from round to round, or the multipliers would chase a moving target.
        """
        for corners in (pairs.upper, pairs.lower):
            np.maximum.at(self._size, corners.ravel(), np.repeat(missing, 3))
        self._size = np.maximum(self._size, lift)
        touched = np.flatnonzero(self._size > 0.0)
        distance, nearest = cKDTree(self._vertices[touched]).query(
            self._vertices, distance_upper_bound=_REGION * _LONGEST
        )
        near = np.flatnonzero(np.isfinite(distance))
        reach = np.clip(_REACH * self._size[touched][nearest[near]], _SHORTEST, _LONGEST)
        inside = distance[near] <= _REGION * reach
        return near[inside], reach[inside]
