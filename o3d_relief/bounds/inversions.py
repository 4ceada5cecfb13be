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
        Those that changed places.
    crossed : int
        Those whose triangles crossed each other in the scene already.
    worst : float
        How far the worst of those that changed places stood the other way round, in relief units.
    gaps_tested, gaps_missed : int
        Pairs that were at least the asked gap apart in the scene, and those that are not in the relief.
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
    crossed = origin.crossed(pairs.upper[turned], pairs.lower[turned])
    inverted = turned[~crossed]
    wide = gap >= max(min_gap, _SAME)
    missed = np.flatnonzero(wide & (pairs.gap < min_gap - _SAME) & (min_gap > 0.0))
    known = pairs.select(few(turned[crossed]))
    places = pair_places("inversion", vertices, pairs.select(few(inverted)), origin)
    places += pair_places("old inversion", vertices, known, origin, crossed=True)
    if len(missed):
        close, asked = pairs.select(few(missed)), pairs.select(wide)
        places += gap_places(vertices, before, close, asked, origin, min_gap=min_gap)
    return Inversions(
        tested=len(pairs),
        inverted=len(inverted),
        crossed=int(crossed.sum()),
        worst=float(np.abs(gap[inverted]).max(initial=0.0)),
        gaps_tested=int(wide.sum()),
        gaps_missed=len(missed),
        places=places,
    )
