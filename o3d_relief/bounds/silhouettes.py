"""Silhouettes, and what is stacked where they cross in the picture."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from o3d_relief.bounds.aligned import APART, aligned_pairs
from o3d_relief.bounds.footprints import footprints
from o3d_relief.bounds.pairs import Pairs

__all__ = ["edges_that_turn", "silhouette_pairs", "silhouettes"]

_FEWEST_CELLS, _MOST_CELLS = 128, 4096
"""Raster, along the longer side, in whose cells edges that may cross are looked up: four for each edge."""

_PIECE = 0.9
"""Length of the pieces of edges, in cells, at most: with a margin they meet four cells."""

_CLEAR = 1e-3
"""Edges cross in the picture where each reaches this far beyond the other, in relief units."""

_BLOCK = 16384
"""Edges that are worked on at once."""


def silhouettes(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """Find the edges at which a surface, seen from the front, ends or turns back.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int64

    Returns
    -------
    (e, 2) int64
        Edges of one face or of more than two, those whose two faces lie on the same side, and those of faces
        that stand upright.
    """
    edges, turning = edges_that_turn(vertices, faces)
    return edges[turning]


def edges_that_turn(
    vertices: NDArray[np.float64], faces: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Find all edges, and those at which a surface, seen from the front, ends or turns back.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int64

    Returns
    -------
    edges : (e, 2) int64
        As `edges_of` does.
    turning : (e,) bool
        See `silhouettes`.
    """
    n = len(vertices)
    x, y = np.ascontiguousarray(vertices[:, :2].T)
    a, b, c = corners = np.ascontiguousarray(faces.T)
    facing = np.sign((x[b] - x[a]) * (y[c] - y[a]) - (y[b] - y[a]) * (x[c] - x[a])).astype(np.int64)
    sided = np.zeros(faces.shape[::-1], dtype=np.int64)
    for number, (start, end) in enumerate(zip(corners, corners[[1, 2, 0]], strict=True)):
        edge = np.minimum(start, end) * n + np.maximum(start, end)
        # The side of the third corner, as seen along rising numbers, goes into the last two bits.
        sided[number] = 4 * edge + np.sign(end - start) * facing + 1
    sided = np.sort(sided, axis=None)
    edge = sided >> 2
    new = np.ones(len(edge), dtype=bool)
    np.not_equal(edge[1:], edge[:-1], out=new[1:])
    first = np.flatnonzero(new)
    count = np.diff(np.append(first, len(edge)))
    second = sided[np.minimum(first + 1, len(edge) - 1)]
    plain = (count == 2) & (((sided[first] & 3) - 1) * ((second & 3) - 1) < 0)
    return np.stack(np.divmod(edge[first], n), axis=1), ~plain


def silhouette_pairs(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    turns: tuple[NDArray[np.int64], NDArray[np.bool_]] | None = None,
) -> Pairs:
    """Pair the points of two silhouettes that cross in the picture.

    Where surfaces have changed places, they did so in a part of the picture that ends where they cross each
    other, or at a silhouette of one of them. So a vertex lies in it, or an edge pierces a triangle at its
    border, or two silhouettes cross at its corner; or the surface has folded over at a silhouette, and the
    edges of neighbours cross there. Silhouettes on top of each other have pairs at their ends.

    Parameters
    ----------
    vertices : (n, 3) float64
        In the relief frame, in relief units.
    faces : (m, 3) int64
    turns : optional
        What `edges_that_turn` returns, where that is at hand already.

    Returns
    -------
    Pairs
        Whether anything lies between them or not.

    Examples
    --------
    Two narrow triangles, crosswise, one unit apart:

    >>> places = np.array([[-9, 0, 0], [9, 0, 0], [9, 1, 0], [0, -9, 1], [0, 9, 1], [1, 9, 1.0]])
    >>> silhouette_pairs(places, np.array([[0, 1, 2], [3, 4, 5]])).gap.tolist()
    [1.0, 1.0, 1.0, 1.0]
    """
    edges, turning = edges_that_turn(vertices, faces) if turns is None else turns
    plane = np.ascontiguousarray(vertices[:, :2])
    # Of edges on top of each other, one tells where all of them cross others.
    prints = footprints(vertices, faces, edges, np.flatnonzero(turning))
    stacked = _overlapping(plane, edges, _in_one_cell(vertices, edges, prints.first))
    far = prints.combined(*_meeting(plane, edges, *stacked)[:2])
    near = _overlapping(plane, edges, _in_one_star(faces, edges, turning))
    one, other = np.concatenate([far, near], axis=1)
    one, other, share, other_share = _meeting(plane, edges, one, other)
    ends, other_ends = vertices[edges[one], 2], vertices[edges[other], 2]
    height = ends[:, 0] * (1.0 - share) + ends[:, 1] * share
    other_height = other_ends[:, 0] * (1.0 - other_share) + other_ends[:, 1] * other_share
    pairs = Pairs.sorted_by(
        height > other_height,
        (edges[one][:, [0, 1, 1]], _weights(share)),
        (edges[other][:, [0, 1, 1]], _weights(other_share)),
        np.abs(height - other_height),
    )
    aligned = aligned_pairs(vertices, edges, prints, stacked)
    return Pairs.join([pairs.select(pairs.gap > APART), aligned])


def _in_one_cell(
    vertices: NDArray[np.float64], edges: NDArray[np.int64], chosen: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Find chosen edges that pass through one cell of a raster: their numbers, (2, q), some twice."""
    low = vertices[:, :2].min(axis=0)
    extent = float(np.ptp(vertices[:, :2], axis=0).max())
    cells = int(np.clip(2.0 * np.sqrt(len(chosen)), _FEWEST_CELLS, _MOST_CELLS))
    begin, end = (vertices[edges[chosen], :2] - low).transpose(1, 0, 2) * (cells / max(extent, 1e-30))
    # Edges in pieces that are no longer than a cell: each meets four cells at most.
    pieces = np.maximum(np.ceil(np.abs(end - begin).max(axis=1) / _PIECE).astype(np.int64), 1)
    edge = np.repeat(np.arange(len(chosen)), pieces)
    number = np.arange(len(edge)) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    step = ((end - begin) / pieces[:, None])[edge]
    first = begin[edge] + step * number[:, None]
    margin = min(_CLEAR * cells / max(extent, 1e-30), (1.0 - _PIECE) / 2.0)
    least = np.floor(np.minimum(first, first + step) - margin).astype(np.int64)
    most = np.floor(np.maximum(first, first + step) + margin).astype(np.int64)
    keys = []
    for corner in np.array([[0, 0], [0, 1], [1, 0], [1, 1]]):
        cell = least + corner
        inside = (cell[:, 0] <= most[:, 0]) & (cell[:, 1] <= most[:, 1])
        place = (cell[inside, 0] + 1) * (cells + 3) + cell[inside, 1] + 1
        keys.append(place * len(edges) + chosen[edge[inside]])
    return _within(np.concatenate(keys), len(edges))


def _in_one_star(
    faces: NDArray[np.int64], edges: NDArray[np.int64], turning: NDArray[np.bool_]
) -> NDArray[np.int64]:
    """Find edges around a vertex of a silhouette that share no vertex: their numbers, (2, q), some twice."""
    n = int(faces.max(initial=0)) + 1
    at_turning = np.zeros(n, dtype=bool)
    at_turning[edges[turning]] = True
    a, b, c = faces.T
    around = faces[at_turning[a] | at_turning[b] | at_turning[c]]
    start = np.ascontiguousarray(around.T)
    end = start[[1, 2, 0]]
    number = np.searchsorted(
        edges[:, 0] * n + edges[:, 1], np.minimum(start, end) * n + np.maximum(start, end)
    )
    keys = []
    for corner in start:
        chosen = at_turning[corner]
        keys.append(corner[chosen] * len(edges) + number[:, chosen])
    both = _within(np.concatenate(keys, axis=1).ravel(), len(edges))
    # What shares a vertex does not cross, and is half of it.
    begin, end = np.ascontiguousarray(edges.T)
    apart = np.zeros(both.shape[1], dtype=bool)
    for block in range(0, both.shape[1], _BLOCK):
        one, other = both[:, block : block + _BLOCK]
        a, b, c, d = begin[one], end[one], begin[other], end[other]
        apart[block : block + _BLOCK] = (a != c) & (a != d) & (b != c) & (b != d)
    return both.compress(apart, axis=1)


def _within(keys: NDArray[np.int64], n: int) -> NDArray[np.int64]:
    """Combine the members of each group with each other; keys are n times the group plus the member."""
    keys = np.sort(keys)
    group, member = np.divmod(keys[np.diff(keys, prepend=-1) > 0], max(n, 1))
    start = np.flatnonzero(np.diff(group, prepend=-1))
    count = np.diff(np.append(start, len(group)))
    later = np.repeat(start + count, count) - np.arange(len(group)) - 1
    one = np.repeat(np.arange(len(group)), later)
    other = one + 1 + np.arange(len(one)) - np.repeat(np.cumsum(later) - later, later)
    return np.stack([member[one], member[other]])


def _overlapping(
    plane: NDArray[np.float64], edges: NDArray[np.int64], both: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Choose the edges whose boxes in the picture overlap or touch: their numbers, (2, q)."""
    used = np.zeros(len(edges), dtype=bool)
    used[both] = True
    begin, end = (plane.take(tip, axis=0) for tip in edges[used].T)
    number = np.cumsum(used, dtype=np.int32) - 1
    box = np.concatenate([np.minimum(begin, end), -np.maximum(begin, end)], axis=1)
    turned = np.ascontiguousarray(box[:, [2, 3, 0, 1]])
    near = np.zeros(both.shape[1], dtype=bool)
    for block in range(0, both.shape[1], _BLOCK):
        one, other = number[both[:, block : block + _BLOCK]]
        beyond = box.take(one, axis=0)
        beyond += turned.take(other, axis=0)
        x, y, back_x, back_y = (beyond <= _CLEAR).T
        near[block : block + _BLOCK] = x & y & back_x & back_y
    return both.compress(near, axis=1)


def _meeting(
    plane: NDArray[np.float64],
    edges: NDArray[np.int64],
    one: NDArray[np.int64],
    other: NDArray[np.int64],
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Choose the edges that cross in the picture, each two once; return where, as shares of both."""
    shares: list[NDArray[np.float64]] = []
    for _ in (0, 1):
        first, second = _sides(plane, edges, one, other)
        apart = np.flatnonzero(first * second < 0.0)
        one, other, first, second = one[apart], other[apart], first[apart], second[apart]
        direction = plane[edges[other, 1]] - plane[edges[other, 0]]
        clear = np.minimum(np.abs(first), np.abs(second)) > _CLEAR * np.linalg.norm(direction, axis=1)
        shares = [(before[apart])[clear] for before in shares] + [(first / (first - second))[clear]]
        one, other = other[clear], one[clear]
    _, once = np.unique(one * len(edges) + other, return_index=True)
    return one[once], other[once], shares[0][once], shares[1][once]


def _sides(
    plane: NDArray[np.float64],
    edges: NDArray[np.int64],
    one: NDArray[np.int64],
    other: NDArray[np.int64],
) -> list[NDArray[np.float64]]:
    """Return on which side of other edges both ends of some lie: twice the area of the triangle."""
    x, y = np.ascontiguousarray(plane.T)
    begin, end = edges[other].T
    origin_x, origin_y = x[begin], y[begin]
    along_x, along_y = x[end] - origin_x, y[end] - origin_y
    return [along_x * (y[tip] - origin_y) - along_y * (x[tip] - origin_x) for tip in edges[one].T]


def _weights(share: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.stack([1.0 - share, share, np.zeros_like(share)], axis=1)
