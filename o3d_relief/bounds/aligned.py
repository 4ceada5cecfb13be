"""Silhouettes that lie on top of each other in the picture, to a rounding error."""

from __future__ import annotations

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
    itself = np.tile(prints.first, (2, 1))
    plane = np.ascontiguousarray(vertices[:, :2])
    a, b = np.concatenate([both, both[::-1], itself], axis=1)
    a, b, place = _on_each_other(plane, edges, a, b)
    covered = _cover(plane, edges, prints, number, a, b, place)
    # Every end above the place, on every edge over the footprint.
    tips, tip_of = prints.members(number[a[covered]])
    ends = edges[tips]
    same = vertices[edges[a, place], :2][covered][tip_of]
    at = np.abs(vertices[ends, :2] - same[:, None]).max(axis=2).argmin(axis=1)
    tip, over = ends[np.arange(len(ends)), at], number[b[covered][tip_of]]
    once = np.unique(tip * len(prints.first) + over)
    tip, over = np.divmod(once, max(len(prints.first), 1))
    return _next_on(vertices, edges, prints, tip, over)


def _on_each_other(
    plane: NDArray[np.float64], edges: NDArray[np.int64], a: NDArray[np.int64], b: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Choose edges a of which an end lies on b in the picture; return them and which end, 0 or 1."""
    found = []
    for end in (0, 1):
        on = np.zeros(len(a), dtype=bool)
        for block in range(0, len(a), _BLOCK):
            part = slice(block, block + _BLOCK)
            share, off, length = projected(plane, edges.take(b[part], axis=0), edges[a[part], end])
            along = (share * length >= -ON) & ((share - 1.0) * length <= ON)
            on[part] = (np.abs(off) <= ON) & along
        found.append((a[on], b[on], np.full(np.count_nonzero(on), end)))
    one, other, ends = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return one, other, ends


def _cover(
    plane: NDArray[np.float64],
    edges: NDArray[np.int64],
    prints: Footprints,
    number: NDArray[np.int64],
    a: NDArray[np.int64],
    b: NDArray[np.int64],
    place: NDArray[np.int64],
) -> NDArray[np.bool_]:
    """Tell for each end of an edge a that lies on b whether faces over the footprints of both overlap."""
    covered = np.zeros(len(a), dtype=bool)
    for block in range(0, len(a), _BLOCK):
        part = slice(block, block + _BLOCK)
        covered[part] = _covers(plane, edges, prints, number, a[part], b[part], place[part])
    return covered


def _covers(
    plane: NDArray[np.float64],
    edges: NDArray[np.int64],
    prints: Footprints,
    number: NDArray[np.int64],
    a: NDArray[np.int64],
    b: NDArray[np.int64],
    place: NDArray[np.int64],
) -> NDArray[np.bool_]:
    """Do so for one block of them."""
    left, right = prints.left, prints.right
    tip, far = edges[a, place], edges[a, 1 - place]
    share, off, length = projected(plane, edges[b], far)
    start, _, _ = projected(plane, edges[b], tip)
    parallel = np.abs(off) <= ON
    stretch = (np.minimum(np.maximum(start, share), 1.0) - np.maximum(np.minimum(start, share), 0.0)) * length
    along = [plane[edges[e, 1]] - plane[edges[e, 0]] for e in (a, b)]
    same_way = np.einsum("qk,qk->q", *along) > 0.0
    a, b = number[a], number[b]
    a_left, a_right = np.where(same_way, left[a], right[a]), np.where(same_way, right[a], left[a])
    together = (a_left & left[b]) | (a_right & right[b])
    inside = (start * length > ON) & ((1.0 - start) * length > ON)  # at corners, other edges tell
    return np.where(parallel, together & (stretch > ON), inside & np.where(off > 0.0, left[b], right[b]))


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
