"""Silhouettes that lie on top of each other in the picture, to a rounding error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from o3d_relief.bounds.pairs import Pairs, as_points

__all__ = ["APART", "Footprints", "aligned_pairs", "footprints"]

_ON = 1e-3
"""A point lies on an edge, in the picture, within this many relief units."""

APART = 5e-4
"""Smallest gap in relief units: edges that touch are in no order."""

_BLOCK = 16384
"""Edges that are worked on at once."""

_ONE_PLACE = 1e-4
"""Rounding, in relief units, by which points count as one in the picture: what is missed costs time only."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Footprints:
    """Edges sorted by what they are in the picture.

    Attributes
    ----------
    first : (s,) int64
        One edge of each footprint.
    edge : (e,) int64
        All edges, by footprint.
    begin : (s + 1,) int64
        Where those of each footprint begin in `edge`.
    left, right : (s,) bool
        Whether there are faces on these sides of the first edge.
    """

    first: NDArray[np.int64]
    edge: NDArray[np.int64]
    begin: NDArray[np.int64]
    left: NDArray[np.bool_]
    right: NDArray[np.bool_]

    def members(self, chosen: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return all edges of chosen footprints, and the place of each one's footprint among the chosen."""
        count = self.begin[chosen + 1] - self.begin[chosen]
        of = np.repeat(np.arange(len(chosen)), count)
        within = np.arange(len(of)) - np.repeat(np.cumsum(count) - count, count)
        return self.edge[self.begin[chosen][of] + within], of

    def numbers(self) -> NDArray[np.int64]:
        """Return the number of the footprint of each edge, -1 for those that have none."""
        number = np.full(int(self.edge.max(initial=-1)) + 1, -1)
        number[self.edge] = np.repeat(np.arange(len(self.first)), np.diff(self.begin))
        return number

    def combined(self, one: NDArray[np.int64], other: NDArray[np.int64]) -> NDArray[np.int64]:
        """Combine all edges over the footprints of some with all over those of others, (2, q)."""
        number = self.numbers()
        edge, of = self.members(number[one])
        second, of_edge = self.members(number[other[of]])
        return np.stack([edge[of_edge], second])


def footprints(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    edges: NDArray[np.int64],
    chosen: NDArray[np.int64],
) -> Footprints:
    """Sort chosen edges, by rising number, by what they are in the picture; upright ones are left out."""
    plane = vertices[:, :2]
    chosen = chosen[np.abs(plane[edges[chosen, 1]] - plane[edges[chosen, 0]]).max(axis=1) > _ON]
    left, right = _beside(plane, faces, edges, chosen)
    ends = _numbered(np.rint(plane[edges[chosen].ravel()] / _ONE_PLACE)).reshape(-1, 2)
    turned = ends[:, 0] > ends[:, 1]
    left, right = np.where(turned, right, left), np.where(turned, left, right)
    key = (ends.min(axis=1) * (ends.max(initial=0) + 1) + ends.max(axis=1)) * 4 + 2 * left + right
    order = np.argsort(key, kind="stable")
    begin = np.flatnonzero(np.diff(key[order], prepend=-1))
    first = order[begin]
    return Footprints(
        first=chosen[first],
        edge=chosen[order],
        begin=np.append(begin, len(order)),
        left=np.where(turned, right, left)[first],
        right=np.where(turned, left, right)[first],
    )


def _numbered(places: NDArray[np.float64]) -> NDArray[np.int64]:
    """Give each of the places (q, 2) a number, the same to the same."""
    order = np.lexsort(places.T)
    new = np.ones(len(order), dtype=bool)
    new[1:] = (places[order[1:]] != places[order[:-1]]).any(axis=1)
    number = np.zeros(len(order), dtype=np.int64)
    number[order] = np.cumsum(new) - 1
    return number


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
            share, off, length = _projected(plane, edges.take(b[part], axis=0), edges[a[part], end])
            along = (share * length >= -_ON) & ((share - 1.0) * length <= _ON)
            on[part] = (np.abs(off) <= _ON) & along
        found.append((a[on], b[on], np.full(np.count_nonzero(on), end)))
    one, other, ends = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return one, other, ends


def _projected(
    plane: NDArray[np.float64], edges: NDArray[np.int64], points: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return where points lie along edges, as a share, how far to their left, and how long they are."""
    begin = plane.take(edges[:, 0], axis=0)
    along, from_begin = plane.take(edges[:, 1], axis=0) - begin, plane.take(points, axis=0) - begin
    length = np.sqrt(along[:, 0] ** 2 + along[:, 1] ** 2)
    share = (along[:, 0] * from_begin[:, 0] + along[:, 1] * from_begin[:, 1]) / length**2
    return share, (along[:, 0] * from_begin[:, 1] - along[:, 1] * from_begin[:, 0]) / length, length


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
    share, off, length = _projected(plane, edges[b], far)
    start, _, _ = _projected(plane, edges[b], tip)
    parallel = np.abs(off) <= _ON
    stretch = (np.minimum(np.maximum(start, share), 1.0) - np.maximum(np.minimum(start, share), 0.0)) * length
    along = [plane[edges[e, 1]] - plane[edges[e, 0]] for e in (a, b)]
    same_way = np.einsum("qk,qk->q", *along) > 0.0
    a, b = number[a], number[b]
    a_left, a_right = np.where(same_way, left[a], right[a]), np.where(same_way, right[a], left[a])
    together = (a_left & left[b]) | (a_right & right[b])
    inside = (start * length > _ON) & ((1.0 - start) * length > _ON)  # at corners, other edges tell
    return np.where(parallel, together & (stretch > _ON), inside & np.where(off > 0.0, left[b], right[b]))


def _beside(
    plane: NDArray[np.float64], faces: NDArray[np.int64], edges: NDArray[np.int64], chosen: NDArray[np.int64]
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Tell on which sides, in the picture, chosen edges have faces: to the left and to the right, (q,)."""
    n = len(plane)
    at = np.zeros(n, dtype=bool)
    at[edges[chosen]] = True
    around = faces[at[faces].sum(axis=1) > 1]
    start, end, opposite = around[:, [[1, 2, 0], [2, 0, 1], [0, 1, 2]]].transpose(1, 0, 2).reshape(3, -1)
    key, own = edges[chosen] @ [n, 1], np.minimum(start, end) * n + np.maximum(start, end)
    found = np.minimum(np.searchsorted(key, own), max(len(key) - 1, 0))
    known = key[found] == own if len(key) else np.zeros(0, dtype=bool)
    found, opposite = found[known], opposite[known]
    _, off, _ = _projected(plane, edges[chosen[found]], opposite)
    left, right = np.zeros(len(chosen), dtype=bool), np.zeros(len(chosen), dtype=bool)
    left[found[off > _ON]] = True
    right[found[off < -_ON]] = True
    return left, right


def _next_on(
    vertices: NDArray[np.float64],
    edges: NDArray[np.int64],
    prints: Footprints,
    tip: NDArray[np.int64],
    over: NDArray[np.int64],
) -> Pairs:
    """Pair vertices with the next edge above and below them among those of a footprint."""
    edge, of = prints.members(over)
    share, _, _ = _projected(vertices[:, :2], edges[edge], tip[of])
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
