"""How far the work is, on a terminal."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from tqdm import tqdm

__all__ = ["BatchBar", "StageBar", "on_terminal", "shown"]

_WITH_SHARE = "  {desc:<13}{percentage:3.0f}% |{bar:30}| {elapsed}"
_WITHOUT = "  {desc:<13}  ... {elapsed}"
_MANY = "{percentage:3.0f}% |{bar:40}| {elapsed}, {remaining} to go"


def on_terminal() -> bool:
    """Tell whether somebody watches: in a log file a bar would only be noise.

    Returns
    -------
    bool
    """
    return sys.stderr is not None and sys.stderr.isatty()


def _size() -> dict[str, int]:
    """Return the size of the terminal; of one that says that it has none, the usual one."""
    try:
        columns, rows = os.get_terminal_size(sys.stderr.fileno())
    except OSError:  # a stream that is none of the system's
        columns, rows = 0, 0
    return {"ncols": (columns or 80) - 1, "nrows": rows or 24}


class StageBar:
    """A bar for the stage that is under way, on a terminal only; it is gone when the stage is done.

    It is given to the library as `on_progress`.
    """

    def __init__(self) -> None:
        self._shown = on_terminal()
        self._bar: Any = None
        self._stage = ""

    def __call__(self, stage: str, share: float | None) -> None:
        """Show how far a stage is.

        Parameters
        ----------
        stage : str
        share : float or None
            From 0 to 1; None where it is not known.
        """
        if not self._shown:
            return
        if self._bar is None or stage != self._stage:
            self.close()
            self._stage = stage
            # Any step counts, and so does none: the clock goes on.
            self._bar = tqdm(
                total=1.0,
                desc=stage,
                bar_format=_WITHOUT,
                file=sys.stderr,
                **_size(),
                leave=False,
                mininterval=0.2,
                miniters=0,
            )
        if share is not None:
            self._bar.bar_format = _WITH_SHARE
        self._bar.update(0.0 if share is None else share - self._bar.n)
        if share == 1.0:
            self.close()

    def close(self) -> None:
        """Take the bar away, if there is one."""
        if self._bar is not None:
            self._bar.close()
            self._bar = None


@contextmanager
def shown(stage: str) -> Iterator[None]:
    """Show, on a terminal, what is under way in a `with` statement.

    Parameters
    ----------
    stage : str
    """
    bar = StageBar()
    bar(stage, None)
    try:
        yield
    finally:
        bar.close()


class BatchBar:
    """A bar for a batch, on a terminal only; lines are written above it.

    It is given to the library as `on_progress`.
    """

    def __init__(self) -> None:
        self._shown = on_terminal()
        self._bar: Any = None

    def __call__(self, _stage: str, share: float | None) -> None:
        """Show how much of the batch is done.

        Parameters
        ----------
        _stage : str
        share : float or None
            From 0 to 1.
        """
        if not self._shown or share is None:
            return
        if self._bar is None:
            # What was done before says nothing about the time that the rest will take.
            self._bar = tqdm(
                total=1.0,
                initial=share,
                bar_format=_MANY,
                file=sys.stderr,
                **_size(),
                leave=False,
                miniters=0,
            )
        self._bar.update(share - self._bar.n)

    def write(self, tell: Callable[[str], None], text: str) -> None:
        """Write a line above the bar.

        Parameters
        ----------
        tell : callable
            Writes it.
        text : str
        """
        if self._bar is not None:
            self._bar.clear()
        tell(text)
        if self._bar is not None:
            self._bar.refresh()

    def close(self) -> None:
        """Take the bar away, if there is one."""
        if self._bar is not None:
            self._bar.close()
            self._bar = None
