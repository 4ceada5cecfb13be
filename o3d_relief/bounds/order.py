"""Surfaces keep their order along every vertical line, and what is visible stays in front of S."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from o3d_relief.bounds.crossings import crossings, edges_of
from o3d_relief.bounds.pairs import Pairs, foot_pairs
from o3d_relief.errors import SolverError
from o3d_relief.linalg.quadratic import minimise

__all__ = ["Ordered", "keep_order", "out_of_order"]

_REACH = 4.0
"""Distance over which a correction fades out, in multiples of its size: slopes change by a quarter."""

_SHORTEST, _LONGEST = 1.5, 8.0
"""The same in relief units, at least and at most."""

_REGION = 3.0
"""What lies further from every correction than this many reaches is not touched, unless it is in the way."""

_MARGIN = 0.05
"""Pairs are set this far beyond their smallest gap, or a quarter of what they have, if that is less."""

_EXACT = 1e-4
"""Relief units by which a gap may miss: well below what float32 rays tell apart."""

_SLACK = 0.01
_FORGETFUL = 7
"""In so many rounds, pairs that have more than this many relief units to spare are no longer held. Later on
every pair that was ever wrong stays held, so that the rounds come to an end."""

_ROUNDS = 40


@dataclass(frozen=True, kw_only=True, eq=False)
class Ordered:
    """Heights in order.

    Attributes
    ----------
    z : (n,) float64
    rounds : int
        Quadratic programmes solved.
    corrected_pairs : int
        Pairs and visible vertices that had to be held.
    left : int
        Pairs that are still out of order, visible vertices still behind S, edges that still pierce.
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
    missed = upper - lower < required_gaps(pairs, min_gap) - _EXACT
    return missed & (np.maximum(upper, lower) > 0.0)


def keep_order(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    laplacian: sp.csr_array,
    areas: NDArray[np.float64],
    z: NDArray[np.float64],
    pairs: Pairs,
    *,
    in_front: NDArray[np.bool_] | None = None,
    min_gap: float = 0.0,
) -> Ordered:
    """Correct heights until no pair is out of order, no edge pierces a triangle, nothing visible is behind S.

    minimise  e' C e + sum of A_i e_i^2 / reach^2   subject to  gap + R (z + e - z_0) >= required gap
    for every pair, and z_i + e_i >= 0 for the vertices in front. The original scene fulfils every
    inequality, so there is always a solution. Few of them bind: in each round those that are violated
    join the ones held so far, one for each two triangles above each other, and the programme is solved
    again. Edges that pierce triangles, between the lines, add pairs of their own.

    Parameters
    ----------
    vertices : (n, 3) float64
        Original positions, in relief units.
    faces : (m, 3) int64
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

    Raises
    ------
    SolverError
        A quadratic programme was not solved.
    """
    front = np.zeros(len(z), dtype=bool) if in_front is None else in_front
    system = _Correction(vertices, laplacian, areas, z)
    edges = edges_of(faces)
    held, floor = np.zeros(len(pairs), dtype=bool), np.zeros(len(z), dtype=bool)
    current, best, fewest, rounds = z, z, np.inf, 0
    while True:
        wrong = out_of_order(pairs, current, min_gap=min_gap)
        behind = front & (current < 0.0)
        crossing, at_foot = (
            _new_crossings(vertices, faces, edges, current),
            foot_pairs(vertices, faces, edges, current),
        )
        left = int(wrong.sum() + behind.sum()) + len(crossing) // 2 + len(at_foot)
        if left < fewest:
            best, fewest = current, left
        if left == 0 or rounds == _ROUNDS:
            break
        if rounds < _FORGETFUL:
            held[held] = ~_spare(pairs.select(held), current, min_gap)
        held |= _worst_of_stacks(pairs, current, wrong, min_gap)
        pairs = Pairs.join([pairs, crossing, at_foot])
        held = np.append(held, np.ones(len(pairs) - len(held), dtype=bool))
        floor |= behind
        chosen = pairs.select(held)
        current = system.solve(chosen, _wanted_gaps(chosen, min_gap), floor)
        current = np.where(floor, np.maximum(current, 0.0), current)
        rounds += 1
    return Ordered(z=best, rounds=rounds, corrected_pairs=int(held.sum() + floor.sum()), left=int(fewest))


def _new_crossings(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    edges: NDArray[np.int64],
    z: NDArray[np.float64],
) -> Pairs:
    """Return two pairs for each edge that pierces a triangle in front of S now, and did not."""
    found = crossings(np.column_stack([vertices[:, :2], z]), faces, edges)
    new = found.pierced(z) & ~found.pierced(vertices[:, 2])
    new &= (z[found.face].max(axis=1) > 0.0) & (z[found.edge].max(axis=1) > 0.0)
    return found.select(new).pairs(vertices[:, 2], z)


def _wanted_gaps(pairs: Pairs, min_gap: float) -> NDArray[np.float64]:
    """Return the gap that pairs are set to: a little more than they must keep, and less than they had."""
    required = required_gaps(pairs, min_gap)
    return np.asarray(required + np.minimum((pairs.gap - required) / 4.0, _MARGIN))


def _spare(pairs: Pairs, z: NDArray[np.float64], min_gap: float) -> NDArray[np.bool_]:
    """Find the pairs that are further apart than they are set to."""
    upper, lower = pairs.heights(z)
    return np.asarray(upper - lower > _wanted_gaps(pairs, min_gap) + _SLACK)


def _worst_of_stacks(
    pairs: Pairs, z: NDArray[np.float64], wrong: NDArray[np.bool_], min_gap: float
) -> NDArray[np.bool_]:
    """Find, of each two triangles above each other, the wrong pair that lacks most of what it must keep.

    A gap is linear over two triangles: hundreds of grid lines through them say hardly more than one.
    """
    among = pairs.select(wrong)
    upper, lower = among.heights(z)
    lacking = required_gaps(among, min_gap) - (upper - lower)
    stack = np.concatenate([among.upper, among.lower], axis=1)
    order = np.lexsort((-lacking, *stack.T))
    first = np.ones(len(order), dtype=bool)
    first[1:] = (stack[order][1:] != stack[order][:-1]).any(axis=1)
    worst = np.zeros(len(pairs), dtype=bool)
    worst[np.flatnonzero(wrong)[order[first]]] = True
    return worst


class _Correction:
    """The quadratic form of the correction, near what has to be corrected."""

    def __init__(
        self,
        vertices: NDArray[np.float64],
        laplacian: sp.csr_array,
        areas: NDArray[np.float64],
        z: NDArray[np.float64],
    ) -> None:
        self._vertices = vertices
        self._laplacian = laplacian
        self._areas = areas
        self._z = z
        self._size = np.zeros(len(vertices))
        self._widening = 1.0

    def solve(
        self, pairs: Pairs, wanted: NDArray[np.float64], floor: NDArray[np.bool_]
    ) -> NDArray[np.float64]:
        """Return the heights that keep the gaps wanted, and those of `floor` at 0 or above."""
        upper, lower = pairs.heights(self._z)
        missing = wanted - (upper - lower)
        lift = np.where(floor, -self._z, 0.0)
        difference = pairs.difference(len(self._z))
        on_floor = sp.eye_array(len(self._z), format="csr")[floor]
        while True:
            free, reach = self._region(pairs, missing, lift)
            rows = sp.vstack([difference[:, free], on_floor[:, free]], format="csr")
            least = np.concatenate([missing, lift[floor]])
            form = self._laplacian[free][:, free] + sp.diags_array(self._areas[free] / reach**2)
            correction = minimise(form, np.zeros(len(free)), rows, least)
            if correction is not None:
                break
            if len(free) == len(self._z):
                raise SolverError(
                    f"The order of {len(pairs)} pairs of surfaces could not be restored; the mesh is likely "
                    "broken near very thin triangles: repair it, or give in_order=False."
                )
            self._widening *= 2.0  # what lies around the region leaves no room
        result: NDArray[np.float64] = self._z.copy()
        result[free] += correction
        return result

    def _region(
        self,
        pairs: Pairs,
        missing: NDArray[np.float64],
        lift: NDArray[np.float64],
    ) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Return the vertices that a correction may move, and how far it reaches at each of them."""
        for corners in (pairs.upper, pairs.lower):
            np.maximum.at(self._size, corners.ravel(), np.repeat(missing, 3))
        self._size = np.maximum(self._size, lift)
        touched = np.flatnonzero(self._size > 0.0)
        distance, nearest = cKDTree(self._vertices[touched]).query(
            self._vertices, distance_upper_bound=self._widening * _REGION * _LONGEST
        )
        near = np.flatnonzero(np.isfinite(distance))
        reach = np.clip(_REACH * self._size[touched][nearest[near]], _SHORTEST, _LONGEST)
        inside = distance[near] <= self._widening * _REGION * reach
        return near[inside], reach[inside]
