"""Surfaces keep their order along every vertical line, and what is visible stays in front of S."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from o3d_relief.bounds.between import Between
from o3d_relief.bounds.correction import Correction
from o3d_relief.bounds.gaps import EXACT, required_gaps, spare, wanted_gaps, worst_of_stacks
from o3d_relief.bounds.pairs import Pairs
from o3d_relief.bounds.rows import point_rows
from o3d_relief.progress import Tick, share_of_way, silent

__all__ = ["Ordered", "keep_order"]

_FORGETFUL = 7
"""In so many rounds, pairs with room to spare are no longer held, but for those that were wrong again after
that. Later on every pair that was ever wrong stays held, so that the rounds come to an end."""

_ROUNDS = 60

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


def keep_order(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    laplacian: sp.csr_array,
    areas: NDArray[np.float64],
    z: NDArray[np.float64],
    pairs: Pairs,
    *,
    between: Between | None = None,
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
    between : Between, optional
        Of the mesh, where it is at hand already.
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
    lines = _Lines(pairs, len(z), min_gap)
    between = Between(vertices, faces, laplacian) if between is None else between
    between.forget()
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
                rare, count = between.look_closer(current, lines.swapped)
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
            further = further.select(~spare(further, current, min_gap))
        new = Pairs.join([lines.take_worst(), found])
        touched = behind & ~floor
        touched[new.upper] = True
        touched[new.lower] = True
        further = Pairs.join([further, found])
        floor |= behind
        chosen = Pairs.join([lines.held, further])
        current = system.solve(chosen, wanted_gaps(chosen, min_gap), floor, touched)
        current = np.where(floor, np.maximum(current, 0.0), current)
        rounds += 1
    held = len(lines.held) + len(further) + int(floor.sum())
    return Ordered(z=best, rounds=rounds, corrected_pairs=held, left=int(fewest))


class _Lines:
    """The pairs on lines that are known beforehand: which are wrong, and which are held."""

    def __init__(self, pairs: Pairs, n: int, min_gap: float) -> None:
        self._pairs, self._min_gap = pairs, min_gap
        self._required = required_gaps(pairs, min_gap)
        # Two products for all pairs are faster than to look up those of which a vertex has moved.
        self._upper = point_rows(pairs.upper, pairs.upper_weights, n)
        self._lower = point_rows(pairs.lower, pairs.lower_weights, n)
        self._lacking = np.zeros(len(pairs))
        self._held = np.zeros(len(pairs), dtype=bool)
        self._ever, self._again = self._held.copy(), self._held.copy()
        self._swapped = self._held.copy()
        self.wrong = self._held.copy()

    @property
    def held(self) -> Pairs:
        return self._pairs.select(self._held)

    @property
    def swapped(self) -> Pairs:
        """Those that have changed places behind S, up to rounding errors."""
        return self._pairs.select(self._swapped)

    def look_at(self, z: NDArray[np.float64]) -> None:
        """Find what is wrong now."""
        upper, lower = self._upper @ z, self._lower @ z
        self._lacking = self._required - (upper - lower)
        self._swapped = (upper < lower) & (lower < EXACT)
        self.wrong = (self._lacking > EXACT) & (np.maximum(upper, lower) > 0.0)

    def let_go(self, z: NDArray[np.float64]) -> None:
        """Hold no longer what has room to spare."""
        self._held[self._held] = ~spare(self.held, z, self._min_gap)
        self._held |= self._again

    def take_worst(self) -> Pairs:
        """Hold the worst of the wrong pairs, too; return those that were not held before."""
        new = worst_of_stacks(self._pairs, self._lacking, self.wrong) & ~self._held
        self._again |= new & self._ever
        self._held |= new
        self._ever |= new
        return self._pairs.select(new)
