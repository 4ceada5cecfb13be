"""Surfaces that change places between the lines on which their order is kept."""

from __future__ import annotations

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from o3d_relief.bounds.pairs import Pairs, vertex_pairs
from o3d_relief.rays import unit_box

__all__ = ["BetweenLines", "edge_pairs"]

_INSIDE = 1e-3
"""Share at both ends of an edge that does not count as crossing: there it meets its neighbours."""

_SMALLEST_GAP = 1e-5
"""Points that were closer than this, in relief units, are one."""


class BetweenLines:
    """Tells what changes places between the lines on which the order is kept.

    Parameters
    ----------
    vertices : (n, 3) float64
        Original positions.
    faces : (m, 3) int64
    """

    def __init__(self, vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> None:
        self._vertices, self._faces = vertices, faces
        self._edges = np.unique(np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
        self._before = self._crossings(vertices)

    def _crossings(self, vertices: NDArray[np.float64]) -> NDArray[np.int64]:
        """Return the numbers edge * faces + face of what crosses; see `certificate.crossings`."""
        scene, middle, size = unit_box(vertices, self._faces)
        start, end = vertices[self._edges[:, 0]], vertices[self._edges[:, 1]]
        rays = np.concatenate([(start - middle) / size, (end - start) / size], axis=1)
        # Rays go on behind the edge's end and meet all that is there: most need no closer look.
        ahead = rays.copy()
        ahead[:, :3] += _INSIDE * rays[:, 3:]
        nearest = scene.cast_rays(o3d.core.Tensor(ahead.astype(np.float32)))["t_hit"].numpy()
        some = np.flatnonzero(nearest < 1.0 - 2.0 * _INSIDE)
        if len(some) == 0:  # Open3D ends the process on an empty set of rays
            return some
        hits = scene.list_intersections(o3d.core.Tensor(rays[some].astype(np.float32)))
        t = hits["t_hit"].numpy()
        inside = (t > _INSIDE) & (t < 1.0 - _INSIDE)
        edge = some[hits["ray_ids"].numpy()[inside].astype(np.int64)]
        face = hits["primitive_ids"].numpy()[inside].astype(np.int64)
        apart = (self._edges[edge][:, :, None] != self._faces[face][:, None, :]).all(axis=(1, 2))
        found: NDArray[np.int64] = (edge * len(self._faces) + face)[apart]
        return found

    def missed_pairs(self, z: NDArray[np.float64]) -> Pairs:
        """Find what has changed places, and what crosses where nothing crossed before.

        Parameters
        ----------
        z : (n,) float64
            New heights.

        Returns
        -------
        Pairs
            In the order of the original. What lies behind S does not count.
        """
        relief = np.column_stack([self._vertices[:, :2], z])
        fresh = np.setdiff1d(self._crossings(relief), self._before)
        edge, face = self._edges[fresh // len(self._faces)], fresh % len(self._faces)
        between = edge_pairs(self._vertices, self._faces, edge, face)
        if len(between):
            return between.select(np.maximum(*between.heights(z)) > 0.0)
        stacked = vertex_pairs(relief, self._faces)
        gap = np.subtract(*stacked.heights(self._vertices[:, 2]))
        inverted = stacked.select(gap < -_SMALLEST_GAP)
        turned = Pairs(
            upper=inverted.lower,
            upper_weights=inverted.lower_weights,
            lower=inverted.upper,
            lower_weights=inverted.upper_weights,
            gap=-gap[gap < -_SMALLEST_GAP],
        )
        return turned.select(np.maximum(*turned.heights(z)) > 0.0)


def edge_pairs(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], edge: NDArray[np.int64], face: NDArray[np.int64]
) -> Pairs:
    """Pair the ends of the stretch that an edge and a face share, seen from the front.

    The gap between an edge and a face is linear along the edge: it keeps its sign if it does so at the
    two ends of the stretch, which are ends of the edge or lie where it crosses the face's outline.

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
    start, end = start[usable], end[usable]
    edge, corners = edge[usable], corners[usable]
    change = end - start
    safe = np.where(change == 0.0, 1.0, change)
    at_zero = np.where(change == 0.0, np.where(start >= 0.0, -np.inf, np.inf), -start / safe)
    first = np.maximum(np.where(change >= 0.0, at_zero, -np.inf).max(axis=1), 0.0)
    last = np.minimum(np.where(change < 0.0, at_zero, np.inf).min(axis=1), 1.0)
    meet = first <= last
    found = []
    for share in (first, last):
        t = share[meet][:, None]
        own = np.concatenate([1.0 - t, t, np.zeros_like(t)], axis=1)
        weights = start[meet] + t * change[meet]
        found.append(_ordered(vertices[:, 2], edge[meet][:, [0, 1, 1]], own, corners[meet], weights))
    return Pairs.join(found)


def _barycentric(
    vertices: NDArray[np.float64], corners: NDArray[np.int64], points: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the barycentric coordinates of points (q, 2) in faces, not finite where a face is edge-on."""
    a, b, c = vertices[corners][:, :, :2].transpose(1, 0, 2)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
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
