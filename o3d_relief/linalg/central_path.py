"""One step along the central path of a quadratic program, with constraints that may come later."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from o3d_relief.linalg.near_rows import NearRows, room
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
    lack, goes to zero with the steps. Of the rows only those take part that a step has come near.

    Parameters
    ----------
    form, pull, origin, start, lower, upper, rows, bound, positions
        As for `minimise`.

    Attributes
    ----------
    x : (n,) float64
    rounds : int
        Linear systems solved.
    rows : (q, n) sparse float64
        Those that take part; more of them come after the others.
    lack : (q,) float64
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
        self.start = start
        self._go_to(start)
        self.at_lower, self.at_upper = np.flatnonzero(np.isfinite(lower)), np.flatnonzero(np.isfinite(upper))
        self.lower, self.upper = lower[self.at_lower], upper[self.at_upper]
        self._others = NearRows(rows, bound)
        self.rows, self._bound, self.lack = rows[:0], bound[:0], np.zeros(0)
        self.slack = self._slacks()
        self.barrier = _FIRST_BARRIER * self.energy(start) / self._count()
        self._central = self.barrier  # of rows that do not take part
        self.force = [self.barrier / slack for slack in self.slack]
        self.rounds = 0
        self._known = set[bytes]()
        self.newton: Everywhere | Within = Everywhere(form, positions)

    def _go_to(self, x: Vector) -> None:
        self.x, self._resisting = x, self.form @ (x - self.origin)

    def energy(self, x: Vector) -> float:
        """Return (x - o)' H (x - o) / 2."""
        moved = x - self.origin
        if x is self.x:
            return float(0.5 * (moved @ self._resisting))
        return float(0.5 * (moved @ (self.form @ moved)))

    def objective(self, x: Vector) -> float:
        """Return the energy less pull' x."""
        return self.energy(x) - float(self.pull @ x)

    def _count(self) -> int:
        return max(sum(len(slack) for slack in self.slack), 1)

    def _slacks(self) -> Kinds:
        x = self.x
        return [
            x[self.at_lower] - self.lower,
            self.upper - x[self.at_upper],
            self.rows @ x - self._bound + self.lack,
        ]

    def _moves(self, step: Vector) -> Kinds:
        return [step[self.at_lower], -step[self.at_upper], self.rows @ step - self.lack]

    @property
    def lacking(self) -> NDArray[np.bool_]:
        """Rows that are broken, (q,)."""
        return np.asarray(self.lack > self.slack[2])

    def least(self) -> float:
        """Return a bound from below on the objective, as far as forces and x are in balance."""
        return self.objective(self.x) - self.gap() + float(self.lack @ self.force[2])

    def imbalance(self, counted: NDArray[np.bool_]) -> Vector:
        """Return pull - H (x - o) + forces, (n,), those of the bounds and of some rows (q,)."""
        rest = self.pull - self._resisting
        rest[self.at_lower] += self.force[0]
        rest[self.at_upper] -= self.force[1]
        some = np.flatnonzero(counted)
        return np.asarray(rest + self.rows[some].T @ self.force[2][some])

    def broken(self, x: Vector, kept_by: Vector) -> sp.csr_array:
        """Return the known rows that an x breaks, but another one keeps, (q, n)."""
        known = ((self.rows, self._bound), (self._others.rows, self._others.bound))
        return sp.vstack(
            [rows[(rows @ x <= bound) & (rows @ kept_by > bound)] for rows, bound in known]
        ).tocsr()

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
        # As stiff as what they pull at, so that the next step heeds them.
        force = np.maximum(self.barrier / slack, slack / ((rows * rows) @ (1.0 / self.form.diagonal())))
        self._join(rows, bound, slack, slack - here, force)

    def _join(self, rows: sp.csr_array, bound: Vector, slack: Vector, lack: Vector, force: Vector) -> None:
        self.rows = sp.vstack([self.rows, rows]).tocsr()
        self._bound, self.lack = np.concatenate([self._bound, bound]), np.concatenate([self.lack, lack])
        self.slack[2] = np.concatenate([self.slack[2], slack])
        self.force[2] = np.concatenate([self.force[2], force])

    def gap(self) -> float:
        """Return the sum of slack times force."""
        return sum(float(slack @ force) for slack, force in zip(self.slack, self.force, strict=True))

    def advance(self, least_gap: float) -> None:
        """Take one step, Mehrotra's: a first attempt tells how far the gap can be closed.

        Parameters
        ----------
        least_gap : float
            Gap to aim at, at least.
        """
        while True:
            solve = self._system()
            attempt = solve(self._right([np.zeros(len(slack)) for slack in self.slack]))
            moves, changes = self._follow(attempt, [np.zeros(len(slack)) for slack in self.slack])
            self.barrier = max(self._closed(moves, changes), least_gap) / self._count()
            step = solve(self._right(self._target(moves, changes)))
            seen = _least_room(self.slack, self._moves(step))
            reach = self._others.reach(self.x, step, _WATCHED)
            without = min(1.0, _TO_THE_WALL * seen)
            length = min(without, _TO_THE_WALL * float(reach.min(initial=np.inf)))
            self._watch(reach < _WATCHED)
            # Rows that were not in the system and cut the step short: solve once more with them.
            if length > 0.4 or without <= 2.0 * length:
                break
        moves, changes = self._follow(attempt, [np.zeros(len(slack)) for slack in self.slack])
        _, changes = self._follow(step, self._target(moves, changes))
        dual = self._dual_length(changes)
        self._go_to(self.x + length * step)
        self._others.moved(length, step)
        self.lack = (1.0 - length) * self.lack
        self.slack = self._slacks()
        self.force = [force + dual * change for force, change in zip(self.force, changes, strict=True)]
        # What has only just come may have been left without a force.
        self._central = self.barrier
        self.force[2] = np.where(self.force[2] > 0.0, self.force[2], self.barrier / self.slack[2])

    def _watch(self, chosen: NDArray[np.bool_]) -> None:
        """Let rows take part from now on, which were on the central path until now."""
        if chosen.any():
            rows, bound = self._others.take(chosen)
            slack = rows @ self.x - bound
            self._join(rows, bound, slack, np.zeros(len(slack)), self._central / slack)

    def _target(self, moves: Kinds, changes: Kinds) -> Kinds:
        """Return what slack times force shall become: the barrier, less the bend of a first attempt."""
        bent = [self.barrier - move * change for move, change in zip(moves, changes, strict=True)]
        return [np.maximum(one, -_MOST_BENT * self.barrier) for one in bent]

    def _closed(self, moves: Kinds, changes: Kinds) -> float:
        """Return the gap to aim at: the smaller, the further a step goes that aims at none."""
        parts = self.slack, moves, self.force, changes
        length = min(1.0, _TO_THE_WALL * _least_room(self.slack, moves))
        dual = self._dual_length(changes)
        gap = self.gap()
        after = sum(
            float((slack + length * move) @ (force + dual * change))
            for slack, move, force, change in zip(*parts, strict=True)
        )
        return float(after**3 / gap**2) if gap > 0.0 else 0.0

    def _dual_length(self, changes: Kinds) -> float:
        return float(min(1.0, _TO_THE_WALL * _least_room(self.force, changes)))

    def _right(self, target: Kinds) -> Vector:
        """Return the right-hand side of the step that brings slack times force to a target."""
        push = [one / slack for one, slack in zip(target, self.slack, strict=True)]
        right = self.pull - self._resisting
        right[self.at_lower] += push[0]
        right[self.at_upper] -= push[1]
        return np.asarray(right + self.rows.T @ (push[2] + self.force[2] / self.slack[2] * self.lack))

    def _follow(self, step: Vector, target: Kinds) -> tuple[Kinds, Kinds]:
        """Return the changes of the slacks and the forces that belong to a step and its target."""
        moves = self._moves(step)
        changes = [
            (one - force * move) / slack - force
            for one, slack, force, move in zip(target, self.slack, self.force, moves, strict=True)
        ]
        return moves, changes

    def _system(self) -> Solve:
        """Set up the Newton system."""
        stiffness = [force / slack for force, slack in zip(self.force, self.slack, strict=True)]
        diagonal = np.zeros(len(self.x))
        diagonal[self.at_lower] += stiffness[0]
        diagonal[self.at_upper] += stiffness[1]
        self.rounds += 1
        return self.newton.prepare(diagonal, self.rows, stiffness[2])


def _least_room(values: Kinds, moves: Kinds) -> float:
    """Return the step length at which the first of the values becomes zero."""
    return min(float(room(*both).min(initial=np.inf)) for both in zip(values, moves, strict=True))
