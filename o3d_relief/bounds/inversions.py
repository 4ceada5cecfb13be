"""Pairs of surfaces that changed places."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from o3d_relief.bounds.origin import Origin
from o3d_relief.bounds.pairs import Pairs
from o3d_relief.bounds.places import Place, few, gap_places, pair_places

__all__ = ["Inversions", "inversions"]

_SAME = 1e-3
"""Relief units below which float32 rays do not tell two surfaces apart."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Inversions:
    """Pairs that stood the other way round in the scene.

    Attributes
    ----------
    tested : int
    inverted : int
        Those that changed places; surfaces that only touch in the picture are in no order.
    crossed : int
        Those whose triangles crossed each other in the scene already.
    worst : float
        How far the worst of those that changed places stood the other way round, in relief units.
    gaps_tested, gaps_missed : int
        Pairs that were at least the asked gap apart in the scene, and those that are not in the relief;
        surfaces that only touch in the picture miss none.
    places : tuple of Place
        Some of those that changed places, that did so but crossed in the scene, and of the missed gaps.
    """

    tested: int
    inverted: int
    crossed: int
    worst: float
    gaps_tested: int
    gaps_missed: int
    places: tuple[Place, ...]


def inversions(
    vertices: NDArray[np.float64],
    pairs: Pairs,
    before: NDArray[np.float64],
    origin: Origin,
    *,
    min_gap: float = 0.0,
) -> Inversions:
    """Count the pairs of a relief that stood the other way round in the scene.

    Parameters
    ----------
    vertices : (n, 3) float64
        Of the relief, in relief units.
    pairs : Pairs
        What is stacked in the relief.
    before : (n,) float64
        The z of each vertex in the scene.
    origin : Origin
        Of the relief's triangles.
    min_gap : float
        In relief units.

    Returns
    -------
    Inversions
    """
    upper, lower = pairs.heights(before)
    gap = upper - lower
    turned = np.flatnonzero(gap < -_SAME)
    places = _places(vertices, pairs.select(turned))
    # Where the one ends in the picture and the other begins, rays meet both by a rounding error.
    stacked = origin.covers(*places)
    turned, places = turned[stacked], [place[stacked] for place in places]
    crossed = origin.crossed(*places)
    inverted = turned[~crossed]
    wide = gap >= max(min_gap, _SAME)
    missed = np.flatnonzero(wide & (pairs.gap < min_gap - _SAME) & (min_gap > 0.0))
    missed = missed[origin.covers(*_places(vertices, pairs.select(missed)))]
    known = pairs.select(few(turned[crossed]))
    told = pair_places("inversion", vertices, pairs.select(few(inverted)), origin)
    told += pair_places("old inversion", vertices, known, origin, crossed=True)
    if len(missed):
        close, asked = pairs.select(few(missed)), pairs.select(wide)
        told += gap_places(vertices, before, close, asked, origin, min_gap=min_gap)
    return Inversions(
        tested=len(pairs),
        inverted=len(inverted),
        crossed=int(crossed.sum()),
        worst=float(np.abs(gap[inverted]).max(initial=0.0)),
        gaps_tested=int(wide.sum()),
        gaps_missed=len(missed),
        places=told,
    )


def _places(vertices: NDArray[np.float64], pairs: Pairs) -> list[NDArray[np.int64]]:
    """Return the upper and the lower places of pairs as `_met` writes them."""
    return [
        _met(vertices, corners, weights)
        for corners, weights in ((pairs.upper, pairs.upper_weights), (pairs.lower, pairs.lower_weights))
    ]


def _met(
    vertices: NDArray[np.float64], corners: NDArray[np.int64], weights: NDArray[np.float64]
) -> NDArray[np.int64]:
    """Write points of triangles as what a line through them meets: a triangle, an edge or a vertex, (q, 3).

    A line through an edge meets both its triangles, whichever of them the rays report.
    """
    plane = vertices[corners, :2]
    one, other = plane - np.roll(plane, -1, axis=1), plane - np.roll(plane, -2, axis=1)
    across = np.roll(one, -1, axis=1)  # the side opposite to each corner
    area = np.abs(one[..., 0] * other[..., 1] - one[..., 1] * other[..., 0])
    height = area / np.maximum(np.sqrt(across[..., 0] ** 2 + across[..., 1] ** 2), 1e-30)
    off = weights * height < _SAME
    off[off.all(axis=1)] = False
    furthest = np.take_along_axis(corners, weights.argmax(axis=1)[:, None], axis=1)
    return np.where(off, furthest, corners)
