"""How far the work is, told while it lasts; who is told can call it off."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from o3d_relief.errors import Cancelled

__all__ = ["NOBODY", "OnProgress", "Progress", "Tick", "share_of_way", "silent"]

OnProgress = Callable[[str, float | None], object]
"""Takes the name of a stage and the share of it that is done, from 0 to 1, None where that is not known.
Where it returns False, the work is called off."""

Tick = Callable[[float | None], None]
"""What long loops call in each round, with the share that is done or None; it may raise `Cancelled`."""


_NEARLY = 0.99
"""A stage is done when it ends, and not before, whatever its loops think."""


def silent(_share: float | None) -> None:
    """Tell nobody."""


class Progress:
    """Tells how far a stage is, and ends the work where that is answered with False.

    Parameters
    ----------
    on_progress : callable, optional

    Examples
    --------
    >>> progress = Progress(lambda stage, share: print(stage, share))
    >>> progress.begin("order")
    order None
    >>> progress.tick(0.5), progress.tick(None), progress.tick(0.4), progress.end()
    order 0.5
    order 0.5
    order 0.5
    order 1.0
    (None, None, None, None)
    """

    def __init__(self, on_progress: OnProgress | None) -> None:
        self._on_progress = on_progress
        self._stage = ""
        self._share: float | None = None

    def begin(self, stage: str) -> None:
        """Tell that a stage begins.

        Parameters
        ----------
        stage : str

        Raises
        ------
        Cancelled
            The caller's answer was False. So it is with the other methods.
        """
        self._stage, self._share = stage, None
        self._tell()

    def tick(self, share: float | None = None) -> None:
        """Tell how far the stage is; what was told once is not taken back.

        Parameters
        ----------
        share : float, optional
            From 0 to 1; where omitted, the last one still holds. Up to 0.99 is told.
        """
        if share is not None:
            self._share = max(min(share, _NEARLY), self._share or 0.0)
        self._tell()

    def end(self) -> None:
        """Tell that the stage is done."""
        self._share = 1.0
        self._tell()

    def _tell(self) -> None:
        if self._on_progress is None:
            return
        answer = self._on_progress(self._stage, self._share)
        if isinstance(answer, bool | np.bool_) and not answer:
            raise Cancelled(f"The work was called off, in the stage {self._stage}.")


NOBODY = Progress(None)
"""Tells nobody, and is never called off."""


def share_of_way(first: float, now: float, goal: float) -> float:
    """Return how far something that shrinks by about the same factor in each round has come.

    Parameters
    ----------
    first, now, goal : float
        Its size at the start, now and where it ends; greater than 0.

    Returns
    -------
    float
        From 0 to 1.

    Examples
    --------
    >>> share_of_way(1000.0, 10.0, 1.0)
    0.666...
    """
    if now <= goal or first <= goal:
        return 1.0
    return min(max(math.log(first / now) / math.log(first / goal), 0.0), 1.0)
