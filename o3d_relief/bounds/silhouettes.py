"""Silhouettes, and what is stacked where they cross in the picture."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from o3d_relief.bounds.aligned import APART, aligned_pairs
from o3d_relief.bounds.footprints import footprints
from o3d_relief.bounds.meeting import CLEAR, Boxes, combinations, meeting
from o3d_relief.bounds.pairs import Pairs

__all__ = ["edges_that_turn", "silhouette_pairs", "silhouettes"]

_FEWEST_CELLS, _MOST_CELLS = 128, 4096
"""Raster, along the longer side, in whose cells edges that may cross are looked up: four for each edge."""

_PIECE = 0.9
"""Length of the pieces of edges, in cells, at most: with a margin they meet four cells."""


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
    ends = plane.take(edges.ravel(), axis=0).reshape(-1, 4)
    # Of edges on top of each other, one tells where all of them cross others.
    prints = footprints(vertices, faces, edges, np.flatnonzero(turning))
    boxes = Boxes(ends)
    stacked = combinations(_in_one_cell(vertices, edges, prints.first), len(edges), boxes.near)
    far = prints.combined(*meeting(ends, *stacked)[:2])
    begin, end = np.ascontiguousarray(edges.T)

    def apart(one: NDArray[np.int64], other: NDArray[np.int64]) -> NDArray[np.int64]:
        # What shares a vertex does not cross.
        near = boxes.near(one, other)
        one, other = one[near], other[near]
        a, b, c, d = begin[one], end[one], begin[other], end[other]
        return np.asarray(near[(a != c) & (a != d) & (b != c) & (b != d)])

    near = combinations(_in_one_star(faces, edges, turning), len(edges), apart)
    one, other, share, other_share = meeting(ends, *np.concatenate([far, near], axis=1))
    heights, other_heights = vertices[edges[one], 2], vertices[edges[other], 2]
    height = heights[:, 0] * (1.0 - share) + heights[:, 1] * share
    other_height = other_heights[:, 0] * (1.0 - other_share) + other_heights[:, 1] * other_share
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
    """Find the cells of a raster through which chosen edges pass: keys of `combinations`, some twice."""
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
    margin = min(CLEAR * cells / max(extent, 1e-30), (1.0 - _PIECE) / 2.0)
    least = np.floor(np.minimum(first, first + step) - margin).astype(np.int64)
    most = np.floor(np.maximum(first, first + step) + margin).astype(np.int64)
    keys = []
    for corner in np.array([[0, 0], [0, 1], [1, 0], [1, 1]]):
        cell = least + corner
        inside = (cell[:, 0] <= most[:, 0]) & (cell[:, 1] <= most[:, 1])
        place = (cell[inside, 0] + 1) * (cells + 3) + cell[inside, 1] + 1
        keys.append(place * len(edges) + chosen[edge[inside]])
    return np.concatenate(keys)


def _in_one_star(
    faces: NDArray[np.int64], edges: NDArray[np.int64], turning: NDArray[np.bool_]
) -> NDArray[np.int64]:
    """Find the edges of the faces around each vertex of a silhouette: keys of `combinations`, some twice."""
    n = int(faces.max(initial=0)) + 1
    at_turning = np.zeros(n, dtype=bool)
    at_turning[edges[turning]] = True
    a, b, c = faces.T
    around = faces.compress(at_turning[a] | at_turning[b] | at_turning[c], axis=0)
    start = np.ascontiguousarray(around.T)
    end = start[[1, 2, 0]]
    number = _numbers(edges, n, np.minimum(start, end).ravel(), np.maximum(start, end).ravel()).reshape(3, -1)
    keys = []
    for corner in start:
        chosen = np.flatnonzero(at_turning[corner])
        keys.append((corner[chosen] * len(edges) + number[:, chosen]).ravel())
    return np.concatenate(keys)


def _numbers(
    edges: NDArray[np.int64], n: int, low: NDArray[np.int64], high: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Return the numbers of edges between vertices, (q,) each, of which the one is lower than the other."""
    count = np.bincount(edges[:, 0], minlength=n)
    last = np.cumsum(count)
    number, beyond = (last - count)[low], last[low]
    ends = np.ascontiguousarray(edges[:, 1])
    for _ in range(int(count.max(initial=0)).bit_length()):
        middle = (number + beyond) >> 1
        # Where both are the same the search is over; the last edge of all has none behind it.
        less = (ends[np.minimum(middle, len(ends) - 1)] < high) & (middle < beyond)
        number, beyond = np.where(less, middle + 1, number), np.where(less, beyond, middle)
    return number


def _weights(share: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.stack([1.0 - share, share, np.zeros_like(share)], axis=1)
