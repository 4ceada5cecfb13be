"""One step along the central path of a quadratic program, with constraints that may come later."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from o3d_relief.linalg.newton import Everywhere, Solve, Within

__all__ = ["CentralPath"]

_TO_THE_WALL = 0.98
"""Share of the way to the nearest constraint that a step may go."""

_FIRST_BARRIER = 0.3
"""Complementarity at the start, as a share of (x - o)' H (x - o) / 2."""

_SOME_ROOM = 0.2
"""Slack that further rows are given at least, as a share of what they have at the start."""

_WATCHED = 1.6
"""Rows that a step so many times as long would break take part in the next system."""

_MOST_BENT = 5.0
"""Corrections for the bend of the path are cut off at so many times the barrier."""

Vector = NDArray[np.float64]
Kinds = list[Vector]


class CentralPath:
    """Iterate, slacks and multipliers of the three kinds of constraints: lower, upper, rows.

    The iterate lies strictly inside of the constraints that are there from the start. Rows that come later it
    may break at first: their slack is a variable of its own, and what it has more than there is room, the
    lack, goes to zero with the steps.

    Parameters
    ----------
    form, pull, origin, start, lower, upper, rows, bound, positions
        As for `minimise`.

    Attributes
    ----------
    x : (n,) float64
    rounds : int
        Linear systems solved.
    watched : (p,) bool
        Rows that take part.
    lack : (p,) float64
    newton : Everywhere or Within
        Where the steps are taken from; may be exchanged between two of them.
    """

    def __init__(
        self,
        form: sp.csr_array,
        pull: Vector,
        origin: Vector,
        start: Vector,
        lower: Vector,
        upper: Vector,
        rows: sp.csr_array,
        bound: Vector,
        positions: NDArray[np.float64] | None = None,
    ) -> None:
        self.form, self.pull, self.origin = form, pull, origin
        self.x = self.start = start
        self.at_lower, self.at_upper = np.flatnonzero(np.isfinite(lower)), np.flatnonzero(np.isfinite(upper))
        self.lower, self.upper = lower[self.at_lower], upper[self.at_upper]
        self.rows, self.bound, self.lack = rows, bound, np.zeros(len(bound))
        self.watched = np.zeros(len(bound), dtype=bool)
        self.slack = self._slacks()
        self.barrier = _FIRST_BARRIER * self.energy(start) / self._count()
        self.force = [self.barrier / slack for slack in self.slack]
        self.rounds = 0
        self._known = set[bytes]()
        self._active = rows[:0]
        self.newton: Everywhere | Within = Everywhere(form, positions)

    def energy(self, x: Vector) -> float:
        """Return (x - o)' H (x - o) / 2."""
        moved = x - self.origin
        return float(0.5 * (moved @ (self.form @ moved)))

    def objective(self, x: Vector) -> float:
        """Return the energy less pull' x."""
        return self.energy(x) - float(self.pull @ x)

    def _count(self) -> int:
        return max(len(self.at_lower) + len(self.at_upper) + int(self.watched.sum()), 1)

    def _slacks(self) -> Kinds:
        x = self.x
        return [
            x[self.at_lower] - self.lower,
            self.upper - x[self.at_upper],
            self.rows @ x - self.bound + self.lack,
        ]

    def _moves(self, step: Vector) -> Kinds:
        return [step[self.at_lower], -step[self.at_upper], self.rows @ step - self.lack]

    @property
    def lacking(self) -> NDArray[np.bool_]:
        """Rows that are broken, (p,)."""
        return np.asarray(self.lack > self.slack[2])

    def least(self) -> float:
        """Return a bound from below on the objective, as far as forces and x are in balance."""
        return self.objective(self.x) - self.gap() + float(self.lack @ self.force[2])

    def imbalance(self, counted: NDArray[np.bool_]) -> Vector:
        """Return pull - H (x - o) + forces, (n,), those of the bounds and of some rows (p,)."""
        rest = self.pull - self.form @ (self.x - self.origin)
        rest[self.at_lower] += self.force[0]
        rest[self.at_upper] -= self.force[1]
        some = np.flatnonzero(counted)
        return np.asarray(rest + self.rows[some].T @ self.force[2][some])

    def add(self, rows: sp.csr_array, bound: Vector) -> None:
        """Add rows, but for those that have been added before.

        Parameters
        ----------
        rows : (q, n) sparse float64
        bound : (q,) float64
            `start` is strictly inside, x need not be.
        """
        ends = zip(rows.indptr[:-1], rows.indptr[1:], strict=True)
        keys = [rows.indices[i:j].tobytes() + rows.data[i:j].tobytes() for i, j in ends]
        new = [k for k, key in enumerate(keys) if key not in self._known]
        self._known.update(keys)
        rows, bound = rows[new], bound[new]
        here, there = rows @ self.x - bound, rows @ self.start - bound
        slack = np.maximum(np.abs(here), _SOME_ROOM * there)
        self.rows, self.bound = sp.vstack([self.rows, rows]).tocsr(), np.concatenate([self.bound, bound])
        self.watched = np.concatenate([self.watched, np.ones(len(new), dtype=bool)])
        self.lack = np.concatenate([self.lack, slack - here])
        self.slack[2] = np.concatenate([self.slack[2], slack])
        # As stiff as what they pull at, so that the next step heeds them.
        force = np.maximum(self.barrier / slack, slack / ((rows * rows) @ (1.0 / self.form.diagonal())))
        self.force[2] = np.concatenate([self.force[2], force])

    def gap(self) -> float:
        """Return the sum of slack times force."""
        pairs = zip(self._taking_part(self.slack), self._taking_part(self.force), strict=True)
        return sum(float(slack @ force) for slack, force in pairs)

    def _taking_part(self, values: Kinds) -> Kinds:
        return [values[0], values[1], values[2][self.watched]]

    def advance(self, least_gap: float) -> None:
        """Take one step, Mehrotra's: a first attempt tells how far the gap can be closed.

        Parameters
        ----------
        least_gap : float
            Gap to aim at, at least.
        """
        while True:
            solve = self._system()
            _, moves, changes = self._newton(solve, [np.zeros(len(slack)) for slack in self.slack])
            self.barrier = max(self._closed(moves, changes), least_gap) / self._count()
            bent = [self.barrier - move * change for move, change in zip(moves, changes, strict=True)]
            target = [np.maximum(one, -_MOST_BENT * self.barrier) for one in bent]
            step, moves, changes = self._newton(solve, target)
            reach = _room(self.slack[2], moves[2])
            first = min(
                _room(s, m).min(initial=np.inf) for s, m in zip(self.slack[:2], moves[:2], strict=True)
            )
            unseen = ~self.watched & (reach < 1.0)
            length = min(1.0, _TO_THE_WALL * min(first, reach.min(initial=np.inf)))
            without = min(1.0, _TO_THE_WALL * min(first, reach[~unseen].min(initial=np.inf)))
            self.watched |= reach < _WATCHED
            # Rows that were not in the system and cut the step short: solve once more with them.
            if length > 0.4 or without <= 2.0 * length:
                break
        dual = self._dual_length(changes)
        self.x = self.x + length * step
        self.lack = (1.0 - length) * self.lack
        self.slack = self._slacks()
        self.force = [force + dual * change for force, change in zip(self.force, changes, strict=True)]
        # What does not take part yet stays on the central path.
        central = self.barrier / self.slack[2]
        self.force[2] = np.where(self.watched & (self.force[2] > 0.0), self.force[2], central)

    def _closed(self, moves: Kinds, changes: Kinds) -> float:
        """Return the gap to aim at: the smaller, the further a step goes that aims at none."""
        parts = [self._taking_part(values) for values in (self.slack, moves, self.force, changes)]
        rooms = (_room(slack, move).min(initial=np.inf) for slack, move in zip(*parts[:2], strict=True))
        length, dual = min(1.0, _TO_THE_WALL * min(rooms)), self._dual_length(changes)
        gap = self.gap()
        after = sum(
            float((slack + length * move) @ (force + dual * change))
            for slack, move, force, change in zip(*parts, strict=True)
        )
        return float(after**3 / gap**2) if gap > 0.0 else 0.0

    def _dual_length(self, changes: Kinds) -> float:
        pairs = zip(self._taking_part(self.force), self._taking_part(changes), strict=True)
        rooms = (_room(force, change).min(initial=np.inf) for force, change in pairs)
        return float(min(1.0, _TO_THE_WALL * min(rooms)))

    def _newton(self, solve: Solve, target: Kinds) -> tuple[Vector, Kinds, Kinds]:
        """Return the step of x, the slacks and the forces that brings slack times force to a target."""
        push = [one / slack for one, slack in zip(target, self.slack, strict=True)]
        some = np.flatnonzero(self.watched)
        right = self.pull - self.form @ (self.x - self.origin)
        right[self.at_lower] += push[0]
        right[self.at_upper] -= push[1]
        lacking = (self.force[2] / self.slack[2] * self.lack)[some]
        right = right + self._active.T @ (push[2][some] + lacking)
        step = solve(right)
        moves = self._moves(step)
        changes = [
            pushed - force * move / slack - force
            for pushed, slack, force, move in zip(push, self.slack, self.force, moves, strict=True)
        ]
        return step, moves, changes

    def _system(self) -> Solve:
        """Set up the Newton system."""
        stiffness = [force / slack for force, slack in zip(self.force, self.slack, strict=True)]
        diagonal = np.zeros(len(self.x))
        diagonal[self.at_lower] += stiffness[0]
        diagonal[self.at_upper] += stiffness[1]
        some = np.flatnonzero(self.watched)
        self._active = self.rows[some]
        self.rounds += 1
        return self.newton.prepare(diagonal, self._active, stiffness[2][some])


def _room(values: Vector, moves: Vector) -> Vector:
    """Return the step length at which each value becomes zero."""
    falling = moves < 0.0
    return np.where(falling, values / np.where(falling, -moves, 1.0), np.inf)
