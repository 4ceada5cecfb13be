"""Silhouettes that lie on top of each other in the picture, to a rounding error."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from o3d_relief.bounds.footprints import ON, Footprints, projected
from o3d_relief.bounds.pairs import Pairs, as_points

__all__ = ["APART", "aligned_pairs"]

APART = 5e-4
"""Smallest gap in relief units: edges that touch are in no order."""

_BLOCK = 16384
"""Edges that are worked on at once."""


def aligned_pairs(
    vertices: NDArray[np.float64],
    edges: NDArray[np.int64],
    prints: Footprints,
    both: NDArray[np.int64],
) -> Pairs:
    """Pair the ends of silhouettes with those on which they lie in the picture, the next above and below.

    There surfaces can change places although no vertex lies inside the border of the other surface, no edge
    pierces a triangle and no two silhouettes cross: two plates of one outline, which tilt through each other.

    Parameters
    ----------
    vertices : (n, 3) float64
        In relief units.
    edges : (e, 2) int64
    prints : Footprints
        Of the silhouettes.
    both : (2, q) int64
        Footprints, by their first edge, that may lie on top of each other.

    Returns
    -------
    Pairs
        Of surfaces that cover a part of the picture together, not of those that only end where the other
        begins.
    """
    number = prints.numbers()
    ends = np.ascontiguousarray(vertices[:, :2]).take(edges.ravel(), axis=0).reshape(-1, 4)
    first = prints.first
    found = [_on_each_other(ends, one, other) for one, other in (both, both[::-1], (first, first))]
    a, b, place, parallel, same_way, off = (np.concatenate(parts) for parts in zip(*found, strict=True))
    over, covered = number[b], _cover(prints, number[a], number[b], parallel, same_way, off)
    a, place, over = a[covered], place[covered], over[covered]
    # Every end above the place, on every edge over the footprint.
    tips, tip_of = prints.members(number[a])
    corners = edges[tips]
    same = vertices[edges[a, place], :2][tip_of]
    at = np.abs(vertices[corners, :2] - same[:, None]).max(axis=2).argmin(axis=1)
    tip, over = corners[np.arange(len(corners)), at], over[tip_of]
    once = np.unique(tip * len(first) + over)
    tip, over = np.divmod(once, max(len(first), 1))
    return _next_on(vertices, edges, prints, tip, over)


def _on_each_other(
    ends: NDArray[np.float64], a: NDArray[np.int64], b: NDArray[np.int64]
) -> tuple[NDArray[Any], ...]:
    """Choose edges a of which an end lies inside b in the picture, or that lie along b for a stretch.

    Parameters
    ----------
    ends : (e, 4) float64
        x and y of both ends of each edge.
    a, b : (q,) int64

    Returns
    -------
    a, b, place : (c,) int64
        The edges, and which end of a it is, 0 or 1.
    parallel, same_way : (c,) bool
        Whether the other end of a is on the line through b, too, and whether both turn the same way.
    off : (c,) float64
        How far the other end of a is to the left of b.
    """
    found = []
    for begin in range(0, len(a) or 1, _BLOCK):
        block = slice(begin, begin + _BLOCK)
        for place, (chosen, *told) in enumerate(
            _lying(ends.take(a[block], axis=0).T, ends.take(b[block], axis=0).T)
        ):
            found.append((a[block][chosen], b[block][chosen], np.full(len(chosen), place), *told))
    return tuple(np.concatenate(parts) for parts in zip(*found, strict=True))


def _lying(a: NDArray[np.float64], b: NDArray[np.float64]) -> Iterator[tuple[NDArray[Any], ...]]:
    """Do so for each end of one block of them, (4, q)."""
    x, y = b[0], b[1]
    along_x, along_y = b[2] - x, b[3] - y
    length = np.sqrt(along_x**2 + along_y**2)
    # How far along b, and to its left, both ends of a are.
    at = [(along_x * (a[tip] - x) + along_y * (a[tip + 1] - y)) / length for tip in (0, 2)]
    off = [(along_x * (a[tip + 1] - y) - along_y * (a[tip] - x)) / length for tip in (0, 2)]
    stretch = np.minimum(np.maximum(*at), length) - np.maximum(np.minimum(*at), 0.0)
    for tip, far in ((0, 1), (1, 0)):
        parallel = np.abs(off[far]) <= ON
        on = (np.abs(off[tip]) <= ON) & (at[tip] >= -ON) & (at[tip] - length <= ON)
        # At its corners, other edges tell.
        inside = (at[tip] > ON) & (length - at[tip] > ON)
        chosen = np.flatnonzero(on & np.where(parallel, stretch > ON, inside))
        same_way = (a[2] - a[0])[chosen] * along_x[chosen] + (a[3] - a[1])[chosen] * along_y[chosen] > 0.0
        yield chosen, parallel[chosen], same_way, off[far][chosen]


def _cover(
    prints: Footprints,
    a: NDArray[np.int64],
    b: NDArray[np.int64],
    parallel: NDArray[np.bool_],
    same_way: NDArray[np.bool_],
    off: NDArray[np.float64],
) -> NDArray[np.bool_]:
    """Tell whether faces over two footprints overlap, by what `_on_each_other` returns of their edges."""
    left, right = prints.left, prints.right
    a_left, a_right = np.where(same_way, left[a], right[a]), np.where(same_way, right[a], left[a])
    together = (a_left & left[b]) | (a_right & right[b])
    return np.asarray(np.where(parallel, together, np.where(off > 0.0, left[b], right[b])))


def _next_on(
    vertices: NDArray[np.float64],
    edges: NDArray[np.int64],
    prints: Footprints,
    tip: NDArray[np.int64],
    over: NDArray[np.int64],
) -> Pairs:
    """Pair vertices with the next edge above and below them among those of a footprint."""
    edge, of = prints.members(over)
    share, _, _ = projected(vertices[:, :2], edges[edge], tip[of])
    share = share.clip(0.0, 1.0)
    height = vertices[edges[edge, 0], 2] * (1.0 - share) + vertices[edges[edge, 1], 2] * share
    own = vertices[tip, 2]
    found = []
    for sign in (1.0, -1.0):  # the next one below, the next one above
        place = np.concatenate([sign * height + APART, sign * own])
        query = np.concatenate([of, np.arange(len(tip))])
        order = np.lexsort((place, query))
        is_edge = order < len(edge)
        last = np.maximum.accumulate(np.where(is_edge, np.arange(len(order)), -1))
        vertex = np.flatnonzero(~is_edge & (last >= 0))
        before = order[last[vertex]]
        vertex = order[vertex] - len(edge)
        same = of[before] == vertex
        found.append(_as_pairs(vertices, edges, tip[vertex[same]], edge[before[same]], share[before[same]]))
    return Pairs.join(found)


def _as_pairs(
    vertices: NDArray[np.float64],
    edges: NDArray[np.int64],
    tip: NDArray[np.int64],
    edge: NDArray[np.int64],
    share: NDArray[np.float64],
) -> Pairs:
    own = as_points(tip)
    others = edges[edge][:, [0, 1, 1]]
    other_weights = np.stack([1.0 - share, share, np.zeros_like(share)], axis=1)
    difference = vertices[tip, 2] - np.einsum("qc,qc->q", vertices[others, 2], other_weights)
    return Pairs.sorted_by(difference > 0.0, own, (others, other_weights), np.abs(difference))
