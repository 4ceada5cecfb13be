"""What a reconstruction invents is cut away; what is left is sorted into parts and coloured."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

__all__ = ["carry_colors", "keep_parts", "support", "used_only"]

_SUPPORTED = 0.8
"""Surface this near to a point, in local spacings, is measured; the rest is invented."""

_SPARSE = 2.0
"""Octree levels below the density of nearly all the supported surface: two levels are four times sparser."""

_ROUNDS = 6
"""Rounds of averaging along the border."""

_SLIVER = 0.05
"""Vertices this near to the border, in spacings, lie on it: the cut leaves no slivers."""


def support(
    faces: NDArray[np.int64], distance: NDArray[np.float64], density: NDArray[np.float64], max_hole: float
) -> NDArray[np.float64]:
    """Find what of a reconstructed surface points support, and what closes small holes among it.

    A vertex without a point near it, or whose density is far below that of the rest, is invented. Invented
    vertices that hang together stay if none of them is further from the points than half of `max_hole`:
    they close a hole. Everything else, the skins around an open scan, goes.

    Parameters
    ----------
    faces : (f, 3) int64
    distance : (v,) float64
        From each vertex to the nearest point, in local spacings.
    density : (v,) float64
        In octree levels.
    max_hole : float
        In spacings.

    Returns
    -------
    (v,) float64
        Positive inside of what stays, zero along its border, in spacings, between -1 and 1.

    Examples
    --------
    >>> strip = np.arange(38)[:, None] + [0, 1, 2]
    >>> support(strip, np.repeat([0.0, 9.0], 20), np.full(40, 8.0), 10.0)[[0, 39]].round(6).tolist()
    [0.8, -1.0]
    """
    inside = np.clip(_SUPPORTED - distance, -1.0, 1.0)
    near = inside >= 0.0
    depth_of_hole = np.where(near, 0.0, distance)
    if near.any():
        sparse = near & (density < np.percentile(density[near], 1.0) - _SPARSE)
        inside[sparse] = -1.0
        depth_of_hole[sparse] = np.inf  # a bubble around a stray point is no hole
        near &= ~sparse
    edges = _edges(faces)
    depth_of_hole[_boundary(edges, len(distance))] = (
        np.inf
    )  # where the octree ends, the skin would have gone on
    far_edges = edges[~near[edges].any(axis=1)]
    ones = np.ones(len(far_edges), dtype=np.int8)
    graph = sp.coo_array((ones, tuple(far_edges.T)), shape=(len(distance), len(distance)))
    count, patch = connected_components(graph, directed=False)
    widest = np.zeros(count)
    np.maximum.at(widest, patch, np.where(near, 0.0, depth_of_hole))
    inside[~near & (widest[patch] <= max_hole / 2.0)] = 1.0
    return _smoothed(inside, edges)


def _edges(faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the edges (3f, 2) of faces, inner ones twice."""
    return np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])


def _boundary(edges: NDArray[np.int64], vertex_count: int) -> NDArray[np.int64]:
    """Return the vertices of the edges (e, 2) that only one face has."""
    key, count = np.unique(edges.min(axis=1) * vertex_count + edges.max(axis=1), return_counts=True)
    single = key[count == 1]
    return np.unique(np.concatenate([single // vertex_count, single % vertex_count]))


def _smoothed(values: NDArray[np.float64], edges: NDArray[np.int64]) -> NDArray[np.float64]:
    """Average values over neighbouring vertices, so that the border does not follow single points."""
    ones = np.ones(len(edges))
    graph = sp.coo_array((ones, tuple(edges.T)), shape=(len(values), len(values))).tocsr()
    graph = graph + graph.T + sp.eye_array(len(values))
    total = graph.sum(axis=1)
    for _ in range(_ROUNDS):
        values = (graph @ values) / total
    return np.where(np.abs(values) < _SLIVER, 0.0, values)


def keep_parts(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], min_part: float
) -> tuple[NDArray[np.bool_], int]:
    """Find the faces of the parts that are large enough.

    Parameters
    ----------
    vertices : (v, 3) float64
    faces : (f, 3) int64
        At least one.
    min_part : float
        Least area of a part, as a share of the area of the largest one.

    Returns
    -------
    kept : (f,) bool
    dropped : int
        The number of parts that go.

    Examples
    --------
    >>> square = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [9, 0, 0], [9.1, 0, 0], [9, 0.1, 0]])
    >>> keep_parts(square, np.array([[0, 1, 2], [3, 4, 5]]), 0.5)[0].tolist()
    [True, False]
    """
    ends = np.concatenate([faces[:, :2], faces[:, 1:]])
    graph = sp.coo_array(
        (np.ones(len(ends), dtype=np.int8), (ends[:, 0], ends[:, 1])), shape=(len(vertices), len(vertices))
    )
    _, part = connected_components(graph, directed=False)
    width = float(np.ptp(vertices, axis=0).max())
    corners = vertices[faces] / (width if width > 0.0 else 1.0)  # squares of lengths shall not overflow
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    label, number = np.unique(part[faces[:, 0]], return_inverse=True)
    total = np.bincount(number, weights=area, minlength=len(label))
    large = total >= min_part * total.max()
    if min_part == 1.0:
        large = np.arange(len(label)) == np.argmax(total)
    return large[number], int((~large).sum())


def used_only(faces: NDArray[np.int64], vertex_count: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Give new numbers to the vertices that faces use.

    Parameters
    ----------
    faces : (f, 3) int64
    vertex_count : int

    Returns
    -------
    index : (w,) int64
        The used vertices, ascending.
    faces : (f, 3) int64
        With the new numbers.

    Examples
    --------
    >>> used_only(np.array([[1, 2, 4]]), 5)[0].tolist()
    [1, 2, 4]
    """
    used = np.zeros(vertex_count, dtype=bool)
    used[faces] = True
    return np.flatnonzero(used), (np.cumsum(used) - 1)[faces]


def carry_colors(
    vertices: NDArray[np.float64], points: NDArray[np.float64], colors: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Give each vertex the colour of the points around it.

    Parameters
    ----------
    vertices : (w, 3) float64
    points, colors : (n, 3) float64

    Returns
    -------
    (w, 3) float64
        The mean of the four nearest points, weighted with the inverse of the distance.

    Examples
    --------
    >>> carry_colors(np.zeros((1, 3)), np.eye(3), np.eye(3)).round(3).tolist()
    [[0.333, 0.333, 0.333]]
    """
    count = min(4, len(points))
    distance, index = cKDTree(points).query(vertices, k=range(1, count + 1), workers=-1)
    weight = 1.0 / np.maximum(distance, 1e-3 * np.maximum(distance.max(axis=1, keepdims=True), 1e-300))
    return np.asarray(np.einsum("nk,nkj->nj", weight / weight.sum(axis=1, keepdims=True), colors[index]))
