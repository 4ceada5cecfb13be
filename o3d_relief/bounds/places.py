"""Which pairs of a relief do not keep what is guaranteed, and why, where relief and scene tell."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from o3d_relief.bounds.crossings import Crossings
from o3d_relief.bounds.origin import Origin
from o3d_relief.bounds.pairs import Pairs

__all__ = ["Place", "behind_places", "crossing_places", "few", "gap_places", "pair_places", "told"]

_FEW = 10
"""So many places of a kind are listed."""

_TOLD = 3
"""So many places are named in a sentence."""

_SAME_LINE = 1e-3
"""Relief units in x and y up to which points lie on one line: rays are cast in float32."""

_TOUCH = 1e-3
"""Relief units below which surfaces touch."""

_CROSSED = "they crossed in the scene already"
_MEET = "their surfaces are one sheet and meet right beside"
_TOUCHED = "they touched in the scene"
_BESIDE = "right beside, the triangle or its neighbour was crossed in the scene already"


@dataclass(frozen=True, kw_only=True)
class Place:
    """Two surfaces of the relief that do not keep what is guaranteed; everything in relief units.

    Attributes
    ----------
    kind : str
        "visible behind", "inversion", "missed gap", "new crossing", "old inversion" or "old crossing".
    x, y : float
    lower, upper : float
        The z of the two surfaces there; the same one twice for a single vertex.
    reason : str
        Why, where the relief and its scene tell it; else empty.
    """

    kind: str
    x: float
    y: float
    lower: float
    upper: float
    reason: str = ""


def few(found: NDArray[np.int64]) -> NDArray[np.int64]:
    """Choose at most ten of what was found, (q,), spread evenly: neighbours in it are neighbours in space."""
    if len(found) <= _FEW:
        return found
    return found[np.linspace(0, len(found) - 1, _FEW).astype(np.int64)]


def told(places: Iterable[Place], kind: str) -> str:
    """Name the first places of a kind and their reasons for a sentence.

    Examples
    --------
    >>> told([Place(kind="inversion", x=1.0, y=2.0, lower=3.0, upper=4.0, reason="why")], "inversion")
    'for instance at (1.0, 2.0): why'
    """
    by_reason: dict[str, list[str]] = {}
    for place in [place for place in places if place.kind == kind][:_TOLD]:
        by_reason.setdefault(place.reason, []).append(f"({place.x:.1f}, {place.y:.1f})")
    groups = [", ".join(at) + (f": {reason}" if reason else "") for reason, at in by_reason.items()]
    return "for instance at " + "; at ".join(groups)


def behind_places(
    vertices: NDArray[np.float64], heights: NDArray[np.float64], visible: NDArray[np.bool_]
) -> tuple[Place, ...]:
    """List some of the visible vertices that end behind S.

    Parameters
    ----------
    vertices : (n, 3) float64
    heights : (n,) float64
        Before the trim.
    visible : (n,) bool
    """
    chosen = few(np.flatnonzero(visible & (heights < 0.0)))
    return tuple(
        Place(kind="visible behind", x=float(x), y=float(y), lower=float(z), upper=float(z))
        for (x, y), z in zip(vertices[chosen, :2], heights[chosen], strict=True)
    )


def pair_places(
    kind: str, vertices: NDArray[np.float64], pairs: Pairs, origin: Origin, *, crossed: bool = False
) -> tuple[Place, ...]:
    """List pairs that changed places.

    Parameters
    ----------
    kind : str
    vertices : (n, 3) float64
        Of the relief.
    pairs : Pairs
        Those to list.
    origin : Origin
    crossed : bool
        They crossed in the scene.
    """
    if crossed:
        reasons = [_CROSSED] * len(pairs)
    else:
        meet, beside = origin.meet(pairs.upper, pairs.lower), _crossed_beside(pairs, origin)
        reasons = [_MEET if m else _BESIDE if b else "" for m, b in zip(meet, beside, strict=True)]
    return _listed(kind, vertices, pairs, reasons)


def _crossed_beside(pairs: Pairs, origin: Origin) -> NDArray[np.bool_]:
    """Tell whether the one triangle crossed a neighbour of the other one in the scene, (p,)."""
    found = np.zeros(len(pairs), dtype=bool)
    for one, other in ((pairs.upper, pairs.lower), (pairs.lower, pairs.upper)):
        for corner in range(3):
            found |= origin.crossed(one, np.repeat(other[:, [corner]], 3, axis=1))
    return found


def gap_places(
    vertices: NDArray[np.float64],
    before: NDArray[np.float64],
    missed: Pairs,
    asked: Pairs,
    origin: Origin,
    *,
    min_gap: float,
) -> tuple[Place, ...]:
    """List pairs that are closer than asked for.

    Parameters
    ----------
    vertices : (n, 3) float64
        Of the relief.
    before : (n,) float64
        The z of each of them in the scene.
    missed : Pairs
        Those to list.
    asked : Pairs
        All that were to keep the gap.
    origin : Origin
    min_gap : float
        In relief units.
    """
    if len(missed) == 0:
        return ()
    depth = float(np.ptp(vertices[:, 2]))
    scaled = np.subtract(*missed.heights(before)) * depth / float(np.ptp(before))
    lines = _points(vertices[:, :2], asked)
    crossed = origin.crossed(missed.upper, missed.lower)
    meet = origin.meet(missed.upper, missed.lower)
    reasons = []
    for i, point in enumerate(_points(vertices[:, :2], missed)):
        line = asked.select(np.flatnonzero(np.abs(lines - point).max(axis=1) < _SAME_LINE))
        stacked = _disjoint(*line.heights(vertices[:, 2]))
        if crossed[i]:
            reasons.append(_CROSSED)
        elif stacked * (min_gap - _TOUCH) > depth:
            reasons.append(
                f"the gaps asked for there, {stacked} x {min_gap:.3g} = {stacked * min_gap:.3g}, do not fit "
                f"into the relief's depth of {depth:.3g} (relief units)"
            )
        elif meet[i]:
            reasons.append(_MEET)
        elif scaled[i] < min_gap:
            reasons.append(
                f"if all depths shrank alike to the relief's, {scaled[i]:.3g} would be left of the "
                f"{min_gap:.3g} asked for (relief units)"
            )
        else:
            reasons.append("")
    return _listed("missed gap", vertices, missed, reasons)


def crossing_places(
    vertices: NDArray[np.float64],
    before: NDArray[np.float64],
    met: Crossings,
    old: NDArray[np.bool_],
    origin: Origin,
) -> tuple[Place, ...]:
    """List some crossings, new ones first.

    Parameters
    ----------
    vertices : (n, 3) float64
        Of the relief.
    before : (n,) float64
        The z of each of them in the scene.
    met : Crossings
        All that cross in the relief.
    old : (c,) bool
        Those that crossed in the scene, too.
    origin : Origin
    """
    new = met.select(few(np.flatnonzero(~old)))
    touched = np.abs(new.gaps(before)).min(axis=1) <= _TOUCH
    meet = origin.meet(new.edge[:, [0, 1, 1]], new.face)
    beside = np.isin(new.face, met.face[old]) @ np.ones(3) > 0.0
    reasons = [_TOUCHED] * len(new)
    for i in np.flatnonzero(~touched):
        reasons[i] = _MEET if meet[i] else _BESIDE if beside[i] else ""
    known = met.select(few(np.flatnonzero(old)))
    return _at(vertices, "new crossing", new, reasons) + _at(
        vertices, "old crossing", known, [_CROSSED] * len(known)
    )


def _at(vertices: NDArray[np.float64], kind: str, found: Crossings, reasons: list[str]) -> tuple[Place, ...]:
    """Write crossings as places: where the edge passes through the triangle."""
    gaps = np.abs(found.gaps(vertices[:, 2]))
    share = gaps[:, 0] / gaps.sum(axis=1)
    along = found.along[:, 0] + share * (found.along[:, 1] - found.along[:, 0])
    start, end = vertices[found.edge[:, 0]], vertices[found.edge[:, 1]]
    return tuple(
        Place(kind=kind, x=float(x), y=float(y), lower=float(z), upper=float(z), reason=reason)
        for (x, y, z), reason in zip(start + along[:, None] * (end - start), reasons, strict=True)
    )


def _listed(kind: str, vertices: NDArray[np.float64], pairs: Pairs, reasons: list[str]) -> tuple[Place, ...]:
    upper, lower = pairs.heights(vertices[:, 2])
    rows = zip(_points(vertices[:, :2], pairs), lower, upper, reasons, strict=True)
    return tuple(
        Place(kind=kind, x=float(x), y=float(y), lower=float(low), upper=float(high), reason=reason)
        for (x, y), low, high, reason in rows
    )


def _points(plane: NDArray[np.float64], pairs: Pairs) -> NDArray[np.float64]:
    """Return where pairs are, (p, 2)."""
    return np.asarray(np.einsum("pck,pc->pk", plane[pairs.upper], pairs.upper_weights))


def _disjoint(upper: NDArray[np.float64], lower: NDArray[np.float64]) -> int:
    """Return how many of the gaps on a line follow each other: a gap may be known from both of its ends."""
    count, reached = 0, -np.inf
    for i in np.argsort(upper, kind="stable"):
        if lower[i] > reached - _TOUCH / 2.0:
            count, reached = count + 1, float(upper[i])
    return count
