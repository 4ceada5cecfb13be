"""Surfaces that change places between the lines on which their order is kept."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from o3d_relief.bounds.certificate import crossings
from o3d_relief.bounds.pairs import Pairs, vertex_pairs

__all__ = ["edge_pairs", "missed_pairs"]

_SMALLEST_GAP = 1e-5
"""Points that were closer than this, in relief units, are one."""


def missed_pairs(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    z: NDArray[np.float64],
    before: set[tuple[int, int]],
) -> Pairs:
    """Find what has changed places between the lines on which the order was kept.

    Parameters
    ----------
    vertices : (n, 3) float64
        Original positions.
    faces : (m, 3) int64
    z : (n,) float64
        New heights.
    before : set of (edge, face)
        What crosses in the original, see `certificate.crossings`.

    Returns
    -------
    Pairs
        Pairs of points in the order of the original that are in another one now. What lies behind S does not
        count.
    """
    relief = np.column_stack([vertices[:, :2], z])
    now, _ = crossings(relief, faces)
    fresh = np.array(sorted(now - before), dtype=np.int64).reshape(-1, 2)
    edges = np.unique(np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    between = edge_pairs(vertices, faces, edges[fresh[:, 0]], fresh[:, 1])
    stacked = vertex_pairs(relief, faces)
    gap = np.subtract(*stacked.heights(vertices[:, 2]))
    inverted = stacked.select(gap < -_SMALLEST_GAP)
    turned = Pairs(
        upper=inverted.lower,
        upper_weights=inverted.lower_weights,
        lower=inverted.upper,
        lower_weights=inverted.upper_weights,
        gap=-gap[gap < -_SMALLEST_GAP],
    )
    found = Pairs.join([between, turned])
    return found.select(np.maximum(*found.heights(z)) > 0.0)


def edge_pairs(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], edge: NDArray[np.int64], face: NDArray[np.int64]
) -> Pairs:
    """Pair the ends of the stretch that an edge and a face share, seen from the front.

    The gap between an edge and a face is linear along the edge: it keeps its sign if it does so at the two ends
    of the stretch, which are ends of the edge or lie where it crosses the outline of the face.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int64
    edge : (q, 2) int64
    face : (q,) int64

    Returns
    -------
    Pairs
        At most 2 q; points closer than 1e-5 relief units are left out.
    """
    corners = faces[face]
    # Signed distances of both ends of the edge to the sides of the face, as barycentric coordinates.
    start = _barycentric(vertices, corners, vertices[edge[:, 0], :2])
    end = _barycentric(vertices, corners, vertices[edge[:, 1], :2])
    usable = np.isfinite(start).all(axis=1) & np.isfinite(end).all(axis=1)
    change = end - start
    safe = np.where(change == 0.0, 1.0, change)
    at_zero = np.where(change == 0.0, np.where(start >= 0.0, -np.inf, np.inf), -start / safe)
    first = np.maximum(np.where(change >= 0.0, at_zero, -np.inf).max(axis=1), 0.0)
    last = np.minimum(np.where(change < 0.0, at_zero, np.inf).min(axis=1), 1.0)
    usable &= first <= last
    found = []
    for share in (first, last):
        t = share[usable][:, None]
        own = np.concatenate([1.0 - t, t, np.zeros_like(t)], axis=1)
        weights = start[usable] + t * change[usable]
        found.append(
            _ordered(vertices[:, 2], edge[usable][:, [0, 1, 1]], own, corners[usable], weights)
        )
    return Pairs.join(found)


def _barycentric(
    vertices: NDArray[np.float64], corners: NDArray[np.int64], points: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the barycentric coordinates of points (q, 2) in faces seen from the front, not finite if edge-on."""
    a, b, c = vertices[corners][:, :, :2].transpose(1, 0, 2)
    with np.errstate(divide="ignore", invalid="ignore"):
        area = _cross(b - a, c - a)
        second, third = _cross(points - a, c - a) / area, _cross(b - a, points - a) / area
    return np.stack([1.0 - second - third, second, third], axis=1)


def _cross(one: NDArray[np.float64], other: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0])


def _ordered(
    z: NDArray[np.float64],
    one: NDArray[np.int64],
    one_weights: NDArray[np.float64],
    other: NDArray[np.int64],
    other_weights: NDArray[np.float64],
) -> Pairs:
    """Make pairs of points of which either may be the upper one."""
    gap = np.einsum("pc,pc->p", z[one], one_weights) - np.einsum("pc,pc->p", z[other], other_weights)
    above = (gap > 0.0)[:, None]
    pairs = Pairs(
        upper=np.where(above, one, other),
        upper_weights=np.where(above, one_weights, other_weights),
        lower=np.where(above, other, one),
        lower_weights=np.where(above, other_weights, one_weights),
        gap=np.abs(gap),
    )
    return pairs.select(pairs.gap > _SMALLEST_GAP)
