"""Linear inequalities of which only those that a step may come near are looked at."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

__all__ = ["NearRows", "room"]

_AHEAD = 1.5
"""The rows are gathered that a way so many times as long may come near."""

_SPARE = 8.0
"""They are gathered anew, being too many, where a way so many times as long would do with them, too."""

_MOST = 0.5
"""Share of all rows from which on leaving the others out would not pay."""

Vector = NDArray[np.float64]


class NearRows:
    """The rows R x >= b that x is close to, among those that have not been taken.

    A step that moves no unknown by more than `way` changes no row by more than `way` times the sum of its
    weights. So of most rows it is known for some time that nothing comes near them.

    Parameters
    ----------
    rows : (p, n) sparse float64
        R.
    bound : (p,) float64
        b.

    Attributes
    ----------
    rows, bound
        The same: all of them.
    """

    def __init__(self, rows: sp.csr_array, bound: Vector) -> None:
        self.rows, self.bound = rows, bound
        weights = sp.csr_array((np.abs(rows.data), rows.indices, rows.indptr), shape=rows.shape)
        self._width = weights @ np.ones(rows.shape[1])
        self._taken = np.zeros(len(bound), dtype=bool)
        self._number = np.zeros(0, dtype=np.int64)
        self._rows, self._slack, self._moves = rows[:0], np.zeros(0), np.zeros(0)
        self._reach = 0.0 if len(bound) else np.inf

    def reach(self, x: Vector, step: Vector, times: float) -> Vector:
        """Return how many times a step can be gone before each row that is near is broken, (q,).

        Parameters
        ----------
        x : (n,) float64
            The sum of all steps before.
        step : (n,) float64
        times : float
            What would not be broken on so many times the step need not be near.
        """
        way = times * float(np.abs(step).max(initial=0.0))
        few = len(self._number) <= _MOST * len(self.bound)
        if way > self._reach or (not few and _SPARE * way < self._reach):
            self._gather(x, way)
        self._moves = self._rows @ step
        return room(self._slack, self._moves)

    def _gather(self, x: Vector, way: float) -> None:
        slack = self.rows @ x - self.bound
        near = ~self._taken & (slack < _AHEAD * way * self._width)
        if np.count_nonzero(near) > _MOST * len(near):
            self._reach, self._rows, self._number = np.inf, self.rows, np.arange(len(near))
            self._slack = np.where(self._taken, np.inf, slack)
        else:
            self._reach, self._number = _AHEAD * way, np.flatnonzero(near)
            self._rows, self._slack = self.rows[self._number], slack[self._number]

    def take(self, chosen: NDArray[np.bool_]) -> tuple[sp.csr_array, Vector]:
        """Take rows out, (q,); return them, and their bounds."""
        number = self._number[chosen]
        self._taken[number] = True
        self._slack[chosen] = np.inf
        return self.rows[number], self.bound[number]

    def moved(self, length: float, step: Vector) -> None:
        """Go a share of the step that `reach` was asked about last."""
        self._slack += length * self._moves
        self._reach -= length * float(np.abs(step).max(initial=0.0))


def room(values: Vector, moves: Vector) -> Vector:
    """Return the step length at which each value becomes zero, infinite where it does not."""
    falling = moves < 0.0
    never = np.full(len(values), np.inf)
    return np.asarray(np.divide(values, -moves, out=never, where=falling))
