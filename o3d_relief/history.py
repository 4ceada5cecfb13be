"""Undo and redo."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeVar

__all__ = ["History"]

_State = TypeVar("_State")


class History(Generic[_State]):
    """States that can be gone back to.

    Examples
    --------
    >>> history: History[str] = History()
    >>> history.keep("first")
    >>> history.undo("second", print)
    first
    True
    >>> history.redo("first", print)
    second
    True
    >>> history.redo("second", print)
    False
    """

    def __init__(self) -> None:
        self._before: list[_State] = []
        self._after: list[_State] = []

    def keep(self, state: _State, *, continued: bool = False) -> None:
        """Keep the state that a change has just left.

        Parameters
        ----------
        state
        continued : bool
            The change went on with the last one, and goes with it when that is undone.
        """
        if not (continued and self._before):
            self._before.append(state)
        self._after.clear()

    def undo(self, now: _State, go: Callable[[_State], None]) -> bool:
        """Go back.

        Parameters
        ----------
        now
            The state that is left.
        go : callable
            Goes to a state; where it raises, the history stays as it is.

        Returns
        -------
        bool
            False where there is nothing to undo.
        """
        return self._move(self._before, self._after, now, go)

    def redo(self, now: _State, go: Callable[[_State], None]) -> bool:
        """Go forth again, see `undo`."""
        return self._move(self._after, self._before, now, go)

    @staticmethod
    def _move(source: list[_State], target: list[_State], now: _State, go: Callable[[_State], None]) -> bool:
        if not source:
            return False
        go(source[-1])
        source.pop()
        target.append(now)
        return True
