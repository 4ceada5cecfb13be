"""Quadratic programs with many linear inequalities, by an interior point method on multigrid."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sla
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from o3d_relief.linalg.solve import multigrid, solve_direct
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

_LINEAR_TOLERANCE = 1e-2
_LINEAR_STEPS = 150
_DIRECT_UP_TO = 4000
_ROUNDS = 60

Vector = NDArray[np.float64]
MoreRows = Callable[[Vector, Vector], tuple[sp.csr_array, Vector]]


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
        Given an x and one that it has accepted, returns further rows and bounds that the first breaks and the
        second fulfils, none when all is well. Asked now and then, and at the end: what it accepted last is
        returned. `start` counts as accepted.
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
    """Iterate, slacks and multipliers of the three kinds of constraints: lower, upper, rows."""

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
        self.tick = tick
        self.form, self.pull, self.origin = form, pull, origin
        self.x = start
        self.at_lower, self.at_upper = np.flatnonzero(np.isfinite(lower)), np.flatnonzero(np.isfinite(upper))
        self.lower, self.upper = lower[self.at_lower], upper[self.at_upper]
        self.rows, self.bound = rows, bound
        self.watched = np.zeros(len(bound), dtype=bool)
        self.slack = self._slacks()
        count = len(self.at_lower) + len(self.at_upper)
        self.barrier = _FIRST_BARRIER * self._energy(start) / max(count, 1)
        self.force = [self.barrier / slack for slack in self.slack]
        self.rounds = 0

    def _energy(self, x: Vector) -> float:
        moved = x - self.origin
        return float(0.5 * (moved @ (self.form @ moved)))

    def _objective(self, x: Vector) -> float:
        return self._energy(x) - float(self.pull @ x)

    def _slacks(self) -> list[Vector]:
        x = self.x
        return [
            x[self.at_lower] - self.lower,
            self.upper - x[self.at_upper],
            self.rows @ x - self.bound,
        ]

    def _moves(self, step: Vector) -> list[Vector]:
        return [step[self.at_lower], -step[self.at_upper], self.rows @ step]

    def run(self, accuracy: float, more_rows: MoreRows) -> Minimum:
        accepted, next_check = self.x, _CHECK_EVERY
        first_share = self._gap() / max(self._energy(self.x), 1e-300)
        while self.rounds < _ROUNDS:
            longest = self._advance()
            gap = self._gap()
            share = gap / max(self._energy(self.x), 1e-300)
            self.tick(share_of_way(first_share, share, accuracy))
            close = share <= accuracy
            if close or self.rounds >= next_check:
                clean = self._go_back(accepted, *more_rows(self.x, accepted))
                if not clean and (close or self.rounds > _ROUNDS // 2):
                    # Back at the rows just found, all may be well already, and almost as good.
                    enough = (1.0 + 2.0 * accuracy) * self._energy_before
                    clean = self._go_back(accepted, *more_rows(self.x, accepted))
                    close = self._energy(self.x) <= enough
                if clean:
                    accepted = self.x
                    if close:
                        break
                next_check = self.rounds + _CHECK_EVERY
            shrink = 0.1 if longest > 0.6 else 0.3 if longest > 0.3 else 0.6
            count = len(self.at_lower) + len(self.at_upper) + int(self.watched.sum())
            self.barrier = max(shrink * gap, 0.1 * accuracy * self._energy(self.x)) / count
        above = self._objective(accepted) - self._objective(self.x) + self._gap()
        share = above / max(self._energy(accepted), 1e-300)
        return Minimum(x=accepted, rounds=self.rounds, watched=int(self.watched.sum()), gap=share)

    def _go_back(self, accepted: Vector, rows: sp.csr_array, bound: Vector) -> bool:
        """Add rows, and go back towards what was accepted until there is some room to them; tell if none."""
        if len(bound) == 0:
            return True
        self._energy_before = self._energy(self.x)
        here, there = rows @ self.x - bound, rows @ accepted - bound
        wanted = _SOME_ROOM * there
        short = here < wanted
        share = float(((wanted - here)[short] / (there - here)[short]).max(initial=0.0))
        self.x = self.x + share * (accepted - self.x)
        self.rows, self.bound = sp.vstack([self.rows, rows]).tocsr(), np.concatenate([self.bound, bound])
        self.watched = np.concatenate([self.watched, np.ones(len(bound), dtype=bool)])
        self.slack = self._slacks()
        new = self.barrier / self.slack[2][len(self.force[2]) :]
        self.force[2] = np.concatenate([self.force[2], new])
        return False

    def _gap(self) -> float:
        pairs = zip(self._taking_part(self.slack), self._taking_part(self.force), strict=True)
        return sum(float(slack @ force) for slack, force in pairs)

    def _taking_part(self, values: list[Vector]) -> list[Vector]:
        return [values[0], values[1], values[2][self.watched]]

    def _advance(self) -> float:
        """Take one step; return the smaller of its two lengths."""
        while True:
            step = self._direction()
            moves = self._moves(step)
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
        changes = [
            (self.barrier - force * move) / slack - force
            for slack, force, move in zip(self.slack, self.force, moves, strict=True)
        ]
        dual = min(
            float(_room(force, change).min(initial=np.inf))
            for force, change in zip(self._taking_part(self.force), self._taking_part(changes), strict=True)
        )
        dual = min(1.0, _TO_THE_WALL * dual)
        self.x = self.x + length * step
        self.slack = self._slacks()
        self.force = [force + dual * change for force, change in zip(self.force, changes, strict=True)]
        # What does not take part yet stays on the central path.
        self.force[2] = np.where(self.watched, self.force[2], self.barrier / self.slack[2])
        self.force[2] = np.where(self.force[2] > 0.0, self.force[2], self.barrier / self.slack[2])
        return float(min(length, dual))

    def _direction(self) -> Vector:
        """Solve the Newton system."""
        stiffness = [force / slack for force, slack in zip(self.force, self.slack, strict=True)]
        push = [self.barrier / slack for slack in self.slack]
        some = np.flatnonzero(self.watched)
        rows = self.rows[some]
        diagonal = np.zeros(len(self.x))
        diagonal[self.at_lower] += stiffness[0]
        diagonal[self.at_upper] += stiffness[1]
        system = self.form + sp.diags_array(diagonal)
        right = self.pull - self.form @ (self.x - self.origin)
        right[self.at_lower] += push[0]
        right[self.at_upper] -= push[1]
        if len(some):
            system = system + rows.T @ (sp.diags_array(stiffness[2][some]) @ rows)
            right = right + rows.T @ push[2][some]
        self.rounds += 1
        return _solve(system.tocsr(), right, self.tick)


def _room(values: Vector, moves: Vector) -> Vector:
    """Return the step length at which each value becomes zero."""
    falling = moves < 0.0
    return np.where(falling, values / np.where(falling, -moves, 1.0), np.inf)


def _solve(matrix: sp.csr_array, right_hand_side: Vector, tick: Tick) -> Vector:
    """Solve to a low accuracy: the next round mends what is missing, and no constraint depends on it."""
    if len(right_hand_side) <= _DIRECT_UP_TO:
        return solve_direct(matrix, right_hand_side)
    solution, _ = sla.cg(
        matrix,
        right_hand_side,
        rtol=_LINEAR_TOLERANCE,
        atol=0.0,
        maxiter=_LINEAR_STEPS,
        M=multigrid(matrix),
        callback=lambda _solution: tick(None),
    )
    return np.asarray(solution, dtype=np.float64)
