"""Changes of single attenuation points, by hand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from o3d_relief.errors import ParameterError
from o3d_relief.param_checks import check_range, check_whole, told

__all__ = ["ACTIONS", "PointEdit", "check_edits", "merged"]

ACTIONS = ("attach", "scale", "discard")


@dataclass(frozen=True, kw_only=True)
class PointEdit:
    """A change of one attenuation point.

    Parameters
    ----------
    vertex : int
        An input vertex. The edit concerns the attenuation point of the cluster in which it lies, so that it
        keeps its place where k, the seed or the view change; to name a point, give its own vertex.
    action : "attach", "scale" or "discard", optional
        What becomes of the point: it lies on the relief plane, it is released from there to a height of its
        own, or it is left out and the surface goes where its neighbours take it. None: as its relative
        differential says.
    beta : float, optional
        Its attenuation factor. None: that of the parameters.

    Raises
    ------
    ParameterError
        A value out of its range, or an edit that changes nothing.

    Examples
    --------
    >>> PointEdit(vertex=7, beta=0.05).action is None
    True
    """

    vertex: int
    action: str | None = None
    beta: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "vertex", check_whole("vertex", self.vertex, 0, 2**63 - 1))
        if self.action is not None and self.action not in ACTIONS:
            raise ParameterError(
                f'action must be "attach", "scale" or "discard". Got {self.action!r} instead.'
            )
        if self.beta is not None:
            object.__setattr__(self, "beta", check_range("beta", self.beta, 0.0))
        if self.action is None and self.beta is None:
            raise ParameterError(
                f"The edit of vertex {self.vertex} changes nothing: give an action or a beta."
            )


def check_edits(values: Any) -> tuple[PointEdit, ...]:
    """Return a sequence of edits as a tuple.

    Parameters
    ----------
    values : sequence of PointEdit

    Raises
    ------
    ParameterError
        Something else.
    """
    try:
        items = tuple(values)
    except TypeError:
        items = (None,)
    if not all(isinstance(item, PointEdit) for item in items):
        raise ParameterError(f"point_edits must be a sequence of PointEdit. Got {told(values)} instead.")
    return items


def merged(vertex: int, edits: Sequence[PointEdit]) -> PointEdit:
    """Make one edit of several of one point.

    Parameters
    ----------
    vertex : int
        Of the result.
    edits : sequence of PointEdit
        At least one; the last action that is given counts, and the last beta.

    Examples
    --------
    >>> merged(7, [PointEdit(vertex=5, beta=0.1), PointEdit(vertex=7, action="attach")])
    PointEdit(vertex=7, action='attach', beta=0.1)
    """
    action = beta = None
    for edit in edits:
        action = action if edit.action is None else edit.action
        beta = beta if edit.beta is None else edit.beta
    return PointEdit(vertex=vertex, action=action, beta=beta)
