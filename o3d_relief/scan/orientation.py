"""Which way normals point: towards the sensor, or found by propagation and by what is seen from outside."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sla
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from o3d_relief.progress import Tick, silent
from o3d_relief.scan.neighbours import thin

__all__ = ["away_votes", "edge_agreement", "propagate", "towards"]

_NODES = 25_000
"""Points of the graph on which orientations are propagated."""

_EDGES = 10
"""Neighbours of each of them."""

_CELL = 4.0
"""Width, in spacings, of the cells in which the frontmost point hides the others: no gap shows through."""

_AROUND, _FRONT, _UP = 0.4, 0.4, 0.2
"""What the views from all around, from the front and from above count."""

_TRUST = 0.05
"""What is seen from outside against the agreement with one neighbour."""


def towards(
    points: NDArray[np.float64], normals: NDArray[np.float64], sensor: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Turn normals so that they face a sensor.

    Parameters
    ----------
    points, normals : (n, 3) float64
    sensor : (3,) float64
        In the frame of the points.

    Returns
    -------
    (n, 3) float64

    Examples
    --------
    >>> towards(np.zeros((1, 3)), np.array([[0, 0, -1.0]]), np.array([0, 0, 5.0])).tolist()
    [[-0.0, -0.0, 1.0]]
    """
    return np.where(((sensor - points) * normals).sum(axis=1, keepdims=True) < 0.0, -normals, normals)


def away_votes(
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    spacing: float,
    *,
    front: NDArray[np.float64],
    up: NDArray[np.float64],
    tick: Tick = silent,
) -> NDArray[np.float64]:
    """Vote on each normal: whether the point is seen from the side to which it points.

    From each of 26 directions around, and once more from the front and from above, the frontmost points of a
    grid of cells are seen, and each votes with the cosine between its normal and the direction. On a closed
    surface all votes are right. The views from all around say nothing about a sheet, whose two sides are both
    seen; there the front decides, or for level sheets the view from above: a floor is not scanned from below.

    Parameters
    ----------
    points : (n, 3) float64
    normals : (n, 3) float64
        Unit vectors, or zero.
    spacing : float
        In the unit of the points.
    front, up : (3,) float64
        Unit vectors towards the viewer and upwards.
    tick : callable, optional
        Called with the share of the work that is done; it may raise to end the work.

    Returns
    -------
    (n,) float64
        Between -1 and 1; positive where the normal points out of the surface.
    """
    steps = np.array([-1.0, 0.0, 1.0])
    around = np.stack(np.meshgrid(steps, steps, steps), axis=-1).reshape(-1, 3)
    around = around[np.abs(around).sum(axis=1) > 0]
    around /= np.linalg.norm(around, axis=1, keepdims=True)
    views = [(direction, _AROUND / len(around)) for direction in around]
    votes = np.zeros(len(points))
    views += [(front, _FRONT), (up, _UP)]
    for number, (direction, share) in enumerate(views):
        tick(0.7 * number / len(views))  # the rest is for the propagation
        seen = _frontmost(points, direction, _CELL * spacing)
        votes[seen] += share * (normals[seen] @ direction)
    return votes


def _frontmost(points: NDArray[np.float64], direction: NDArray[np.float64], cell: float) -> NDArray[np.bool_]:
    """Find the points that no other one in the same cell hides; a cell is as deep as it is wide."""
    axis = np.eye(3)[np.argmin(np.abs(direction))]
    right = np.cross(axis, direction)
    right /= np.linalg.norm(right)
    across = points @ np.stack([right, np.cross(direction, right)], axis=1)
    height = points @ direction
    place = np.floor((across - across.min(axis=0)) / cell).astype(np.int64)
    key = place[:, 0] * (place[:, 1].max() + 1) + place[:, 1]
    _, group = np.unique(key, return_inverse=True)
    top = np.full(group.max() + 1, -np.inf)
    np.maximum.at(top, group, height)
    return np.asarray(height >= top[group] - cell)


def propagate(
    points: NDArray[np.float64], normals: NDArray[np.float64], votes: NDArray[np.float64], spacing: float
) -> NDArray[np.float64]:
    """Turn normals so that neighbours agree and votes are heard.

    Tangent-plane propagation in the sense of Hoppe et al. (1992), but on all edges of a graph of neighbours
    at once instead of along a spanning tree, which one bad edge misleads. The orientation s of each node
    minimises sum w_ij (s_i - o_ij s_j)^2 + t sum |v_i| (s_i - sign v_i)^2, with o_ij = 1 where the normals of
    the two nodes agree, else -1, v the votes, and weights w_ij that fall to zero where the tangent planes
    are not those of one smooth surface. The graph is that of some 25,000 of the points; the others follow
    their nearest nodes.

    Parameters
    ----------
    points : (n, 3) float64
    normals : (n, 3) float64
        Unit vectors.
    votes : (n,) float64
        Positive where the normal is right as it is.
    spacing : float

    Returns
    -------
    (n, 3) float64
        `normals`, turned or not.
    """
    if len(points) < 4:
        return np.where(votes[:, None] < 0.0, -normals, normals)
    chosen = thin(points, spacing * np.sqrt(len(points) / _NODES)) if len(points) > _NODES else None
    nodes = np.arange(len(points)) if chosen is None else chosen
    tree = cKDTree(points[nodes])
    _, nearest = tree.query(points, k=1, workers=-1)
    relative = _relative(votes, normals, nodes, nearest)
    total: NDArray[np.float64] = np.bincount(nearest, weights=relative, minlength=len(nodes)).astype(
        np.float64
    )
    heard = total / np.maximum(np.bincount(nearest, minlength=len(nodes)), 1)
    sign = _solve_signs(points[nodes], normals[nodes], heard, tree)
    near, index = tree.query(points, k=min(3, len(nodes)), workers=-1)
    along = np.einsum("nj,nkj->nk", normals, normals[nodes][index])
    pull = (sign[index] * along / (near + spacing)).sum(axis=1)
    return np.where(pull[:, None] < 0.0, -normals, normals)


def _relative(
    votes: NDArray[np.float64],
    normals: NDArray[np.float64],
    nodes: NDArray[np.int64],
    nearest: NDArray[np.int64],
) -> NDArray[np.float64]:
    """Return the votes of all points as votes on the normal of their nearest node."""
    return np.asarray(votes * (normals * normals[nodes][nearest]).sum(axis=1))


def _solve_signs(
    points: NDArray[np.float64], normals: NDArray[np.float64], votes: NDArray[np.float64], tree: cKDTree
) -> NDArray[np.float64]:
    """Return the orientation (m,) of each node, positive where its normal is right."""
    m = len(points)
    i, j, weight, same = _edges(points, normals, tree)
    graph = sp.coo_array((weight * same, (i, j)), shape=(m, m)).tocsr()
    degree = np.bincount(np.concatenate([i, j]), weights=np.tile(weight, 2), minlength=m)
    diagonal = degree + _TRUST * np.abs(votes) + 1e-9
    system = (sp.dia_array((diagonal[None], [0]), shape=(m, m)) - graph - graph.T).tocsc()
    return np.asarray(sla.spsolve(system, _TRUST * votes))


def _edges(
    points: NDArray[np.float64], normals: NDArray[np.float64], tree: cKDTree
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Return the ends of the edges (e,), each once, their weights and whether the normals agree (+-1)."""
    count = min(_EDGES, len(points) - 1)
    _, index = tree.query(points, k=count + 1, workers=-1)
    start = np.repeat(np.arange(len(points)), count + 1)
    pairs = np.sort(np.column_stack([start, index.ravel()]), axis=1)
    pairs = np.unique(pairs[pairs[:, 0] != pairs[:, 1]], axis=0)
    i, j = pairs.T
    along = points[j] - points[i]
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), np.finfo(np.float64).tiny)
    # Across a sheet normals are parallel as well: neighbours count where each lies in the other's plane.
    out = np.maximum(np.abs((along * normals[i]).sum(axis=1)), np.abs((along * normals[j]).sum(axis=1)))
    cosine = (normals[i] * normals[j]).sum(axis=1)
    weight = np.abs(cosine) ** 4 * np.maximum(1.0 - out, 0.0) ** 4 + 1e-6
    return i, j, weight, np.where(cosine < 0.0, -1.0, 1.0)


def edge_agreement(
    points: NDArray[np.float64], normals: NDArray[np.float64], index: NDArray[np.int64]
) -> float:
    """Measure how often a normal points to the same side as that of the nearest neighbour.

    Parameters
    ----------
    points, normals : (n, 3) float64
    index : (n,) int64
        The nearest neighbour of each point.

    Returns
    -------
    float
        Share of the points where it does, 1 for none.
    """
    cosine = (normals * normals[index]).sum(axis=1)
    return float((cosine >= 0.0).mean()) if len(points) else 1.0
