"""What the stage viewer shows, apart from any window: each key leads from one state to the next."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

__all__ = ["KEYS", "OWN", "Run", "ViewerState", "arrived", "pressed", "shown"]

KEYS = {
    "right, N": "next stage",
    "left, P": "previous stage",
    "1 ... 9, 0": "the stage of that number, 0 is the tenth",
    "C": "next meaning of the colours",
    "M": "morph between the scene and the relief",
    "B": "blink: before and after the stage",
    "O": "the scene as a wireframe, on or off",
    "A": "the attenuation points, on or off",
    "V": "to the viewpoint u",
    "S": "save a picture",
    "H": "these keys",
    "Q": "close",
}
"""What each key does."""

OWN = "of the stage"
"""The colours that tell most about the stage shown."""

_MORPH_SECONDS = 2.0
_BLINK_SECONDS = 0.5


@dataclass(frozen=True, kw_only=True)
class Run:
    """What a run has brought so far.

    Attributes
    ----------
    names : tuple of str
        Of the stages.
    before : tuple of int or None
        For each stage the last one before it with another surface.
    meanings : tuple of str
        What the colours can mean.
    own : tuple of str
        For each stage the meaning that tells most about it.
    points : bool
        Whether there are attenuation points.
    """

    names: tuple[str, ...] = ()
    before: tuple[int | None, ...] = ()
    meanings: tuple[str, ...] = ()
    own: tuple[str, ...] = ()
    points: bool = False


@dataclass(frozen=True, kw_only=True)
class ViewerState:
    """What is shown.

    Attributes
    ----------
    stage : int
        -1 before the first.
    meaning : str
        Of the colours.
    wireframe, points : bool
        Whether the scene's wireframe and the attenuation points are shown.
    blink_since : float or None
        When the blinking began, in seconds.
    morph_from : int or None
        The stage from which the surface moves to that of `stage`.
    morph_since : float
        When it set off.
    note : str
        What the last key had to tell.
    """

    stage: int = -1
    meaning: str = OWN
    wireframe: bool = False
    points: bool = False
    blink_since: float | None = None
    morph_from: int | None = None
    morph_since: float = 0.0
    note: str = ""

    @property
    def moving(self) -> bool:
        """Whether the picture changes by itself."""
        return self.blink_since is not None or self.morph_from is not None


def pressed(state: ViewerState, key: str, now: float, run: Run) -> ViewerState:
    """Return the state after a key; keys that change nothing in it (V, S, H, Q) are the window's.

    Parameters
    ----------
    state : ViewerState
    key : str
        "N", "P", "0" ... "9", "C", "M", "B", "O" or "A".
    now : float
        In seconds.
    run : Run

    Returns
    -------
    ViewerState
    """
    state = replace(state, note="")
    if not run.names:
        return replace(state, note="no stage is done yet")
    if key.isdigit():
        return _jump(state, (int(key) - 1) % 10, run)
    return _ACTS[key](state, now, run)


def arrived(state: ViewerState, run: Run) -> ViewerState:
    """Return the state after a new stage: who looks at the newest one sees the new one at once."""
    newest = len(run.names) - 1
    following = state.stage == newest - 1 and not state.moving
    return replace(state, stage=newest, note="") if following else state


def shown(state: ViewerState, now: float, run: Run) -> tuple[int, int, float, ViewerState]:
    """Find out what to draw.

    Parameters
    ----------
    state : ViewerState
    now : float
        In seconds.
    run : Run

    Returns
    -------
    start, end : int
        Stages.
    share : float
        How far the surface is on its way from the first to the second, 0 to 1.
    state : ViewerState
        Without the morph, where it has come to its end.
    """
    if state.morph_from is not None:
        share = (now - state.morph_since) / _MORPH_SECONDS
        if share < 1.0:
            return state.morph_from, state.stage, _smooth(share), state
        state = replace(state, morph_from=None)
    if state.blink_since is not None:
        other = run.before[state.stage]
        odd = int((now - state.blink_since) / _BLINK_SECONDS) % 2 == 0
        number = other if odd and other is not None else state.stage
        return number, number, 1.0, state
    return state.stage, state.stage, 1.0, state


def _smooth(share: float) -> float:
    """Start and end at rest."""
    return 0.5 - 0.5 * math.cos(math.pi * min(max(share, 0.0), 1.0))


def _jump(state: ViewerState, stage: int, run: Run) -> ViewerState:
    if not 0 <= stage < len(run.names):
        return replace(state, note=f"there are {len(run.names)} stages so far")
    return replace(state, stage=stage, blink_since=None, morph_from=None)


def _points(state: ViewerState, _now: float, run: Run) -> ViewerState:
    if not run.points:
        return replace(state, note="there are no attenuation points")
    return replace(state, points=not state.points)


def _next_meaning(state: ViewerState, run: Run) -> str:
    """Walk through the meanings; what the stage shows by itself comes first and not again."""
    own = run.own[state.stage]
    names = (OWN, *(name for name in run.meanings if name != own))
    position = names.index(state.meaning) if state.meaning in names else 0
    return names[(position + 1) % len(names)]


def _blink(state: ViewerState, now: float, run: Run) -> ViewerState:
    if state.blink_since is not None:
        return replace(state, blink_since=None)
    if run.before[state.stage] is None:
        return replace(state, note="nothing has moved up to this stage")
    return replace(state, blink_since=now, morph_from=None)


def _morph(state: ViewerState, now: float, run: Run) -> ViewerState:
    """Go to the newest stage from one that shows the scene, to the scene from any other, and back."""
    if state.morph_from is not None:  # turn round on the way
        gone = min((now - state.morph_since) / _MORPH_SECONDS, 1.0)
        since = now - (1.0 - gone) * _MORPH_SECONDS
        return replace(state, stage=state.morph_from, morph_from=state.stage, morph_since=since)
    newest = len(run.names) - 1
    if run.before[newest] is None:
        return replace(state, note="there is no relief yet")
    target = newest if run.before[state.stage] is None else 0
    return replace(state, stage=target, morph_from=state.stage, morph_since=now, blink_since=None)


_ACTS: dict[str, Callable[[ViewerState, float, Run], ViewerState]] = {
    "N": lambda state, _now, run: _jump(state, state.stage + 1, run),
    "P": lambda state, _now, run: _jump(state, state.stage - 1, run),
    "C": lambda state, _now, run: replace(state, meaning=_next_meaning(state, run)),
    "O": lambda state, _now, _run: replace(state, wireframe=not state.wireframe),
    "A": _points,
    "B": _blink,
    "M": _morph,
}
