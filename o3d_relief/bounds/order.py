"""Surfaces keep their order along every vertical line, and what is visible stays in front of S."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from o3d_relief.bounds.correction import Correction
from o3d_relief.bounds.crossings import edges_of, new_crossings
from o3d_relief.bounds.cuts import cut_crossings
from o3d_relief.bounds.hinges import hinged_pairs
from o3d_relief.bounds.pairs import Pairs, foot_pairs
from o3d_relief.bounds.parted import Parted
from o3d_relief.bounds.raster import Raster
from o3d_relief.progress import Tick, share_of_way, silent

__all__ = ["Ordered", "keep_order", "out_of_order", "worst_of_stacks"]

_MARGIN = 0.05
"""Pairs are set this far beyond their smallest gap, or a quarter of what they have, if that is less."""

_EXACT = 1e-4
"""Relief units by which a gap may miss: well below what float32 rays tell apart."""

_SLACK = 0.01
_FORGETFUL = 7
"""In so many rounds, pairs that have more than this many relief units to spare are no longer held, but for
those that were wrong again after that. Later on every pair that was ever wrong stays held, so that the rounds
come to an end."""

_ROUNDS = 40

_FEW = 3000
"""Pairs out of order on lines up to which edges that pierce triangles are looked for at the same time."""

_HARDLY_ANY = 200
"""What is out of order, on lines and between them, up to which what is rare is looked for, too."""


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
    tick: Tick = silent,
) -> Ordered:
    """Correct heights until no pair is out of order, no edge pierces a triangle, nothing visible is behind S.

    minimise  e' C e + sum of A_i e_i^2 / reach^2   subject to  gap + R (z + e - z_0) >= required gap
    for every pair, and z_i + e_i >= 0 for the vertices in front. The original scene fulfils every
    inequality, so there is always a solution. Few of them bind: in each round those that are violated
    join the ones held so far, one for each two triangles above each other, and what lies around them is
    solved again. Edges that pierce triangles, between the lines, add pairs of their own.

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
    tick : callable, optional
        Called in every round with the share of the work that is done, as far as the number of pairs that are
        still out of order tells; it may raise to end the work.

    Returns
    -------
    Ordered

    Raises
    ------
    SolverError
        A quadratic programme was not solved.
    """
    front = np.zeros(len(z), dtype=bool) if in_front is None else in_front
    system = Correction(vertices, laplacian, areas, z)
    lines, between = _Lines(pairs, len(z), min_gap), _BetweenLines(vertices, faces, laplacian)
    further, floor = Pairs.join([]), np.zeros(len(z), dtype=bool)
    current, best, fewest, rounds, first = z, z, np.inf, 0, 0
    while True:
        lines.look_at(current)
        behind = front & (current < 0.0)
        found, left = Pairs.join([]), int(lines.wrong.sum() + behind.sum())
        # What crosses is mostly out of order on a line as well: while there is much of it, lines will do.
        if left <= _FEW or rounds == _ROUNDS:
            found, count = between.look_at(current)
            left += count
            if left <= _HARDLY_ANY:
                rare, count = between.look_closer(current, pairs)
                found, left = Pairs.join([found, rare]), left + count
            found = found.select(np.subtract(*found.heights(current)) < required_gaps(found, min_gap))
            if left < fewest:
                best, fewest = current, left
        first = first or left
        tick(share_of_way(first + 1.0, left + 1.0, 1.0))
        if left == 0 or rounds == _ROUNDS:
            break
        if rounds < _FORGETFUL:
            lines.let_go(current)
            further = further.select(~_spare(further, current, min_gap))
        new = Pairs.join([lines.take_worst(current), found])
        touched = behind & ~floor
        touched[new.upper] = True
        touched[new.lower] = True
        further = Pairs.join([further, found])
        floor |= behind
        chosen = Pairs.join([lines.held, further])
        current = system.solve(chosen, _wanted_gaps(chosen, min_gap), floor, touched)
        current = np.where(floor, np.maximum(current, 0.0), current)
        rounds += 1
    held = len(lines.held) + len(further) + int(floor.sum())
    return Ordered(z=best, rounds=rounds, corrected_pairs=held, left=int(fewest))


class _BetweenLines:
    """Looks for edges that have begun to pierce triangles, and for what changed places where S cuts it."""

    def __init__(
        self, vertices: NDArray[np.float64], faces: NDArray[np.int64], laplacian: sp.csr_array
    ) -> None:
        self._vertices, self._faces = vertices, faces
        self._edges, self._raster = edges_of(faces), Raster(vertices, faces)
        self._corners, self._ends = np.ascontiguousarray(faces.T), np.ascontiguousarray(self._edges.T)
        self._last = np.full(len(vertices), np.nan)
        self._parted = Parted(vertices, faces, laplacian, self._raster)

    def look_at(self, z: NDArray[np.float64]) -> tuple[Pairs, int]:
        """Return pairs that keep apart what was found, and how much it was, where something has moved."""
        vertices, faces = self._vertices, self._faces
        moved = z != self._last
        self._last = z
        a, b, c = self._corners
        changed = moved[a] | moved[b] | moved[c]
        near = np.ones(len(faces), dtype=bool) if changed.all() else self._raster.over_or_under(changed)
        at = np.zeros(len(z), dtype=bool)
        at[faces[near]] = True
        first, last = self._ends
        edges = self._edges[at[first] & at[last]]
        # Edges that moved may pierce what lies near; the others, triangles that moved.
        own = moved[edges[:, 0]] | moved[edges[:, 1]]
        looked = [new_crossings(vertices, faces[near], edges[own], z)]
        if not own.all():
            looked.append(new_crossings(vertices, faces[changed], edges[~own], z))
        in_front, behind = z > 0.0, z < 0.0
        cut = near & (in_front[a] | in_front[b] | in_front[c]) & (behind[a] | behind[b] | behind[c])
        at_foot = foot_pairs(vertices, faces[near & self._raster.over_or_under(cut)], edges, z)
        found = Pairs.join([*(pairs for pairs, _ in looked), at_foot])
        return found, sum(count for _, count in looked) + len(at_foot)

    def look_closer(self, z: NDArray[np.float64], pairs: Pairs) -> tuple[Pairs, int]:
        """Return pairs for what is rare: it hangs together over S, stands at the cut, or crossed before."""
        hinged = hinged_pairs(self._vertices, self._faces, pairs, z)
        parted = self._parted.look_at(z)
        parted = parted.select(out_of_order(parted, z))
        cut, count = cut_crossings(self._vertices, self._faces, self._raster, z)
        return Pairs.join([hinged, parted, cut]), len(hinged) + len(parted) + count


class _Lines:
    """The pairs on lines that are known beforehand: which are wrong, and which are held."""

    def __init__(self, pairs: Pairs, n: int, min_gap: float) -> None:
        self._pairs, self._min_gap = pairs, min_gap
        self._corners = np.concatenate([pairs.upper.T, pairs.lower.T])
        self._held = np.zeros(len(pairs), dtype=bool)
        self._ever, self._again = self._held.copy(), self._held.copy()
        self._last = np.full(n, np.nan)
        self.wrong = np.zeros(len(pairs), dtype=bool)

    @property
    def held(self) -> Pairs:
        return self._pairs.select(self._held)

    def look_at(self, z: NDArray[np.float64]) -> None:
        """Find what is wrong now; only pairs of which a vertex has moved can have changed."""
        moved = z != self._last
        self._last = z
        of_moved = np.zeros(len(self._pairs), dtype=bool)
        for corner in self._corners:
            of_moved |= moved[corner]
        changed = np.flatnonzero(of_moved)
        self.wrong[changed] = out_of_order(self._pairs.select(changed), z, min_gap=self._min_gap)

    def let_go(self, z: NDArray[np.float64]) -> None:
        """Hold no longer what has room to spare."""
        self._held[self._held] = ~_spare(self.held, z, self._min_gap)
        self._held |= self._again

    def take_worst(self, z: NDArray[np.float64]) -> Pairs:
        """Hold the worst of the wrong pairs, too; return those that were not held before."""
        lacking = np.zeros(len(self._pairs))
        wrong = self._pairs.select(self.wrong)
        lacking[self.wrong] = required_gaps(wrong, self._min_gap) - np.subtract(*wrong.heights(z))
        new = worst_of_stacks(self._pairs, lacking, self.wrong) & ~self._held
        self._again |= new & self._ever
        self._held |= new
        self._ever |= new
        return self._pairs.select(new)


def _wanted_gaps(pairs: Pairs, min_gap: float) -> NDArray[np.float64]:
    """Return the gap that pairs are set to: a little more than they must keep, and less than they had."""
    required = required_gaps(pairs, min_gap)
    return np.asarray(required + np.minimum((pairs.gap - required) / 4.0, _MARGIN))


def _spare(pairs: Pairs, z: NDArray[np.float64], min_gap: float) -> NDArray[np.bool_]:
    """Find the pairs that are further apart than they are set to."""
    upper, lower = pairs.heights(z)
    return np.asarray(upper - lower > _wanted_gaps(pairs, min_gap) + _SLACK)


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
