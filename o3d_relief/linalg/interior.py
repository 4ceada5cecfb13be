"""Quadratic programs with many linear inequalities, by an interior point method on multigrid."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from o3d_relief.linalg.rough import RoughSolver, Solve
from o3d_relief.progress import Tick, share_of_way, silent

__all__ = ["Minimum", "minimise"]

_TO_THE_WALL = 0.98
"""Share of the way to the nearest constraint that a step may go."""

_FIRST_BARRIER = 0.3
"""Complementarity at the start, as a share of (x - o)' H (x - o) / 2."""

_CHECK_EVERY = 3
"""Rounds after which further rows are asked for."""

_SOME_ROOM = 0.2
"""Room that further rows are given, as a share of what they have where they were last fulfilled."""

_WATCHED = 1.6
"""Rows that a step so many times as long would break take part in the next system."""

_CENTRAL = 0.6
"""Gap below which the iteration does not aim, as a share of the accuracy: from well inside of all constraints
it is not far to where rows that come later hold, too."""

_MOST_BENT = 5.0
"""Corrections for the bend of the central path are cut off at so many times the barrier."""

_ROUNDS = 80

Vector = NDArray[np.float64]
Kinds = list[Vector]
MoreRows = Callable[[Vector], tuple[sp.csr_array, Vector]]


@dataclass(frozen=True, kw_only=True, eq=False)
class Minimum:
    """The minimum of a quadratic program.

    Attributes
    ----------
    x : (n,) float64
        Strictly inside every constraint.
    rounds : int
        Linear systems solved.
    watched : int
        Rows that took part.
    gap : float
        Bound on how far the objective is above its minimum, as a share of (x - o)' H (x - o) / 2.
    """

    x: Vector
    rounds: int
    watched: int
    gap: float


def minimise(
    form: sp.csr_array,
    pull: Vector,
    *,
    origin: Vector,
    start: Vector,
    lower: Vector,
    upper: Vector,
    rows: sp.csr_array,
    bound: Vector,
    more_rows: MoreRows,
    accuracy: float = 0.03,
    tick: Tick = silent,
) -> Minimum:
    """Minimise (x - o)' H (x - o) / 2 - pull' x  subject to  lower <= x <= upper  and  R x >= bound.

    A primal-dual interior point method, whose iterates lie strictly inside all constraints. Each round
    solves one linear system, H plus springs on the constraints, by conjugate gradients with smoothed
    aggregation multigrid, so that time and memory grow linearly. Of the rows only those that a step has come
    near take part in the systems; all of them limit the steps.

    Parameters
    ----------
    form : (n, n) sparse float64
        H, positive semi-definite, and definite together with the bounds.
    pull : (n,) float64
    origin : (n,) float64
        o.
    start : (n,) float64
        Strictly inside all constraints.
    lower, upper : (n,) float64
        Infinite where there is no bound.
    rows : (p, n) sparse float64
        R.
    bound : (p,) float64
    more_rows : callable
        Given an x, returns further rows and bounds that `start` is strictly inside of, none when all is well.
        Asked now and then, and at the end: only an x with which all is well is returned, or `start`.
    accuracy : float
        Gap between the objective and its dual, as a share of (x - o)' H (x - o) / 2, at which the iteration
        stops.
    tick : callable, optional
        Called in every step of the linear solver, and in every round with the share of the way from the first
        gap to `accuracy`; it may raise to end the work.

    Returns
    -------
    Minimum
    """
    with threadpool_limits(limits=1):  # sums that do not depend on the number of threads
        iteration = _Iteration(form, pull, origin, start, lower, upper, rows, bound, tick)
        return iteration.run(accuracy, more_rows)


class _Iteration:
    """Iterate, slacks and multipliers of the three kinds of constraints: lower, upper, rows.

    Rows that come later need not be fulfilled: their slack is a variable of its own, and what it is larger
    than the room that there is, the lack, goes to zero.
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
        tick: Tick,
    ) -> None:
        self.form, self.pull, self.origin = form, pull, origin
        self.x = self.start = start
        self.at_lower, self.at_upper = np.flatnonzero(np.isfinite(lower)), np.flatnonzero(np.isfinite(upper))
        self.lower, self.upper = lower[self.at_lower], upper[self.at_upper]
        self.rows, self.bound, self.lack = rows, bound, np.zeros(len(bound))
        self.watched = np.zeros(len(bound), dtype=bool)
        self.slack = self._slacks()
        self.barrier = _FIRST_BARRIER * self._energy(start) / max(self._count(), 1)
        self.force = [self.barrier / slack for slack in self.slack]
        self.rounds = 0
        self._tick, self._solver, self._known = tick, RoughSolver(tick), set[bytes]()

    def _energy(self, x: Vector) -> float:
        moved = x - self.origin
        return float(0.5 * (moved @ (self.form @ moved)))

    def _objective(self, x: Vector) -> float:
        return self._energy(x) - float(self.pull @ x)

    def _count(self) -> int:
        return len(self.at_lower) + len(self.at_upper) + int(self.watched.sum())

    def _slacks(self) -> Kinds:
        x = self.x
        return [
            x[self.at_lower] - self.lower,
            self.upper - x[self.at_upper],
            self.rows @ x - self.bound + self.lack,
        ]

    def _moves(self, step: Vector) -> Kinds:
        return [step[self.at_lower], -step[self.at_upper], self.rows @ step - self.lack]

    def run(self, accuracy: float, more_rows: MoreRows) -> Minimum:
        accepted, next_check = self.x, _CHECK_EVERY
        first_share = self._gap() / max(self._energy(self.x), 1e-300)
        while self.rounds < _ROUNDS:
            self._advance(_CENTRAL * accuracy * self._energy(self.x))
            share = self._gap() / max(self._energy(self.x), 1e-300)
            self._tick(share_of_way(first_share, share, accuracy))
            waiting = (self.lack > self.slack[2]).any()
            if self.rounds >= next_check or (share <= accuracy and not waiting):
                accepted = self._check(accepted, more_rows)
                if self._above(accepted) <= accuracy * self._energy(accepted):
                    break
                next_check = self.rounds + (2 if share <= accuracy else 3)
        share = self._above(accepted) / max(self._energy(accepted), 1e-300)
        return Minimum(x=accepted, rounds=self.rounds, watched=int(self.watched.sum()), gap=share)

    def _above(self, x: Vector) -> float:
        """Bound how far the objective at an x is above its minimum."""
        lacking = float(self.lack @ self.force[2])
        return self._objective(x) - self._objective(self.x) + self._gap() - lacking

    def _check(self, accepted: Vector, more_rows: MoreRows) -> Vector:
        """Return x where all is well; else add rows, and return the better of two others where it is."""
        rows, bound = more_rows(self.x)
        if len(bound) == 0:
            return self.x
        here, there = rows @ self.x - bound, rows @ accepted - bound
        wanted = _SOME_ROOM * there
        short = here < np.minimum(wanted, there)
        share = float(((wanted - here)[short] / (there - here)[short]).max(initial=0.0))
        nearer = self.x + share * (accepted - self.x)
        self._add(rows, bound)
        if self.rounds > _ROUNDS // 2 and share < 1.0 and self._objective(nearer) < self._objective(accepted) and _none(more_rows(nearer)):
            return nearer
        return accepted

    def _add(self, rows: sp.csr_array, bound: Vector) -> None:
        """Add rows, those that are not known yet."""
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
        force = np.maximum(self.barrier / slack, slack / ((rows * rows) @ (1.0 / self.form.diagonal())))
        self.force[2] = np.concatenate([self.force[2], force])

    def _gap(self) -> float:
        pairs = zip(self._taking_part(self.slack), self._taking_part(self.force), strict=True)
        return sum(float(slack @ force) for slack, force in pairs)

    def _taking_part(self, values: Kinds) -> Kinds:
        return [values[0], values[1], values[2][self.watched]]

    def _advance(self, least_gap: float) -> None:
        """Take one step, Mehrotra's: the first attempt at one tells how far the gap can be closed."""
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
        gap = self._gap()
        after = sum(
            float((slack + length * move) @ (force + dual * change))
            for slack, move, force, change in zip(*parts, strict=True)
        )
        return float(gap * (after / gap) ** 3)

    def _dual_length(self, changes: Kinds) -> float:
        pairs = zip(self._taking_part(self.force), self._taking_part(changes), strict=True)
        return min(1.0, _TO_THE_WALL * min(_room(force, change).min(initial=np.inf) for force, change in pairs))

    def _newton(self, solve: Solve, target: Kinds) -> tuple[Vector, Kinds, Kinds]:
        """Solve for the step that brings slack times force to a target: of x, of the slacks, of the forces."""
        push = [one / slack for one, slack in zip(target, self.slack, strict=True)]
        some = np.flatnonzero(self.watched)
        right = self.pull - self.form @ (self.x - self.origin)
        right[self.at_lower] += push[0]
        right[self.at_upper] -= push[1]
        lacking = (self.force[2] / self.slack[2] * self.lack)[some]
        right = right + self.rows[some].T @ (push[2][some] + lacking)
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
        rows = self.rows[some]
        springs = rows.T @ (sp.diags_array(stiffness[2][some]) @ rows)
        self.rounds += 1
        return self._solver.prepare((self.form + sp.diags_array(diagonal) + springs).tocsr())


def _none(further: tuple[sp.csr_array, Vector]) -> bool:
    return len(further[1]) == 0


def _room(values: Vector, moves: Vector) -> Vector:
    """Return the step length at which each value becomes zero."""
    falling = moves < 0.0
    return np.where(falling, values / np.where(falling, -moves, 1.0), np.inf)
