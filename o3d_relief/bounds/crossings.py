"""Edges that pierce triangles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from o3d_relief.bounds.pairs import Pairs
from o3d_relief.rays import unit_box

__all__ = ["DEEP", "Crossings", "cross", "crossings", "edges_of", "once", "stretches"]

DEEP = 1e-3
"""An edge pierces a triangle where it reaches at least this far, in relief units, to both of its sides and,
seen from the front, away from its border: less is what float32 rays cannot tell from contact."""

_INSIDE = 1e-4
"""Share at both ends of an edge that does not count as crossing: there it meets its neighbours."""

_BLOCK = 16384
"""Edges that are worked on at once."""

_OVER = 3e-5
"""How far over its edge a ray passes, in relief units: it does not meet the triangles of the edge, and of
the crossings that count it misses none."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Crossings:
    """Edges and triangles that may cross, and the stretch of each edge above or below its triangle.

    Attributes
    ----------
    edge : (c, 2) int64
    face : (c, 3) int64
    along : (c, 2) float64
        Where the stretch begins and ends, as shares of the edge.
    inside : (c, 2, 3) float64
        Barycentric coordinates of the triangle there.
    """

    edge: NDArray[np.int64]
    face: NDArray[np.int64]
    along: NDArray[np.float64]
    inside: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.edge)

    def gaps(self, z: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the height of the edge above the triangle at both ends of the stretch, (c, 2)."""
        first, last = z[self.edge].T[:, :, None]
        on_edge = first + self.along * (last - first)
        return np.asarray(on_edge - np.einsum("cek,ck->ce", self.inside, z[self.face]))

    def pierced(self, z: NDArray[np.float64], *, deep: float = DEEP) -> NDArray[np.bool_]:
        """Find those that cross for the vertex heights z, (c,), by more than `deep` to both sides."""
        begin, finish = self.gaps(z).T
        return np.asarray((np.minimum(begin, finish) < -deep) & (np.maximum(begin, finish) > deep))

    def pairs(self, before: NDArray[np.float64], after: NDArray[np.float64]) -> Pairs:
        """Return both ends of the stretches as pairs that were in order before.

        Parameters
        ----------
        before : (n,) float64
            Heights for which none of them cross. Where edge and triangle touch, `after` tells which of the
            two counts as the upper one.
        after : (n,) float64

        Returns
        -------
        Pairs
            Two for each; the gap of those that touch is 0 or a little less.
        """
        gap = self.gaps(before)
        middle = gap.sum(axis=1)
        touching = np.abs(gap).max(axis=1) <= DEEP
        middle = np.where(touching, self.gaps(after).sum(axis=1), middle)
        # The end that is further off tells the side: the other one lies within a rounding error of it.
        furthest = np.take_along_axis(gap, np.abs(gap).argmax(axis=1)[:, None], axis=1)[:, 0]
        edge_above = np.repeat(np.where(touching, middle, furthest) >= 0.0, 2)
        edge_corners = np.repeat(self.edge[:, [0, 1, 1]], 2, axis=0)
        along = self.along.ravel()
        edge_weights = np.stack([1.0 - along, along, np.zeros_like(along)], axis=1)
        face_corners = np.repeat(self.face, 2, axis=0)
        face_weights = self.inside.reshape(-1, 3)
        return Pairs.sorted_by(
            edge_above,
            (edge_corners, edge_weights),
            (face_corners, face_weights),
            np.where(edge_above, gap.ravel(), -gap.ravel()),
        )

    def select(self, chosen: NDArray[np.bool_] | NDArray[np.int64]) -> Crossings:
        """Return some of them, by a mask or by number."""
        number = np.flatnonzero(chosen) if chosen.dtype == bool else chosen
        return Crossings(
            edge=self.edge.take(number, axis=0),
            face=self.face.take(number, axis=0),
            along=self.along.take(number, axis=0),
            inside=self.inside.take(number, axis=0),
        )


def edges_of(faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the edges of a mesh, (e, 2), each once, by their vertices in rising order."""
    start = np.ascontiguousarray(faces.T)
    end = start[[1, 2, 0]]
    n = int(faces.max(initial=0)) + 1
    keys = (np.minimum(start, end) * n + np.maximum(start, end)).ravel()
    return np.stack(np.divmod(once(keys), n), axis=1)


def crossings(vertices: NDArray[np.float64], faces: NDArray[np.int64], edges: NDArray[np.int64]) -> Crossings:
    """Find the edges that meet triangles of a welded mesh from one side to the other.

    Parameters
    ----------
    vertices : (n, 3) float64
        In relief units.
    faces : (m, 3) int64
    edges : (e, 2) int64
        See `edges_of`.

    Returns
    -------
    Crossings
        Candidates found by rays in float32; `Crossings.pierced` tells exactly. An edge and a triangle that
        share a vertex do not count, nor do triangles that stand upright on S: nothing is above them.
    """
    none = np.zeros(0, dtype=np.int64)
    if len(edges) == 0 or len(faces) == 0:  # all that is left of the relief has shrunk to lines
        return stretches(vertices[:, :2], edges[none], faces[none])
    scene, middle, size = unit_box(vertices, faces)
    places = (vertices - middle + [0.0, 0.0, _OVER]) / size
    rays = _rays(places, edges)
    # Whether a ray meets anything between its ends is known fast; where, takes its whole line. Some meet
    # triangles next to their own edge, by a rounding error: most of these do not on the way back.
    candidates = np.flatnonzero(_meets(scene, rays))
    if len(candidates):
        candidates = candidates[_meets(scene, _rays(places, edges[candidates][:, ::-1]))]
    if len(candidates) == 0:  # Open3D dies of a list without rays
        return stretches(vertices[:, :2], edges[none], faces[none])
    hits = scene.list_intersections(o3d.core.Tensor(rays[candidates]))
    t = hits["t_hit"].numpy()
    ray = candidates[hits["ray_ids"].numpy().astype(np.int64)]
    triangle = hits["primitive_ids"].numpy().astype(np.int64)
    inside = (t > _INSIDE) & (t < 1.0 - _INSIDE)
    edge, face = edges[ray[inside]], faces[triangle[inside]]
    apart = (edge[:, :, None] != face[:, None, :]).all(axis=(1, 2))
    return stretches(vertices[:, :2], edge[apart], face[apart])


def _rays(places: NDArray[np.float64], edges: NDArray[np.int64]) -> NDArray[np.float32]:
    """Return rays along edges, from 0 to 1."""
    rays = np.zeros((len(edges), 6), dtype=np.float32)
    for begin in range(0, len(edges), _BLOCK):
        part = slice(begin, begin + _BLOCK)
        start, end = (places.take(edges[part, tip], axis=0) for tip in (0, 1))
        rays[part, :3] = start
        rays[part, 3:] = end - start
    return rays


def _meets(scene: o3d.t.geometry.RaycastingScene, rays: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Tell which rays meet anything between their ends."""
    hits = scene.test_occlusions(o3d.core.Tensor(rays), tnear=_INSIDE, tfar=1.0 - _INSIDE)
    return np.asarray(hits.numpy())


def stretches(plane: NDArray[np.float64], edge: NDArray[np.int64], face: NDArray[np.int64]) -> Crossings:
    """Clip edges, seen from the front, to triangles.

    Parameters
    ----------
    plane : (n, 2) float64
        x and y of the vertices, in relief units.
    edge : (c, 2) int64
    face : (c, 3) int64
        What each edge may pierce.

    Returns
    -------
    Crossings
        Without those that do not lie above or below each other, or hardly.
    """
    # Row by row: numpy takes several times as long over axes of two or three.
    x, y = np.ascontiguousarray(plane.T)
    corner_x, corner_y = x[face.T], y[face.T]
    side_x, side_y = (rows[[2, 0, 1]] - rows[[1, 2, 0]] for rows in (corner_x, corner_y))
    opposite = np.sqrt(side_x * side_x + side_y * side_y)
    x_to_c, y_to_c, x_to_b, y_to_b = -side_x[1], -side_y[1], side_x[2], side_y[2]
    area = x_to_b * y_to_c - y_to_b * x_to_c
    safe = np.where(area == 0.0, 1.0, area)
    at_ends = []
    for tip in edge.T:
        across, up = x[tip] - corner_x[0], y[tip] - corner_y[0]
        second, third = (across * y_to_c - up * x_to_c) / safe, (x_to_b * up - y_to_b * across) / safe
        at_ends.append(np.stack([1.0 - second - third, second, third]))
    first, change = at_ends[0], at_ends[1] - at_ends[0]
    moving = change != 0.0
    zero = -first / np.where(moving, change, 1.0)
    begin = np.where(moving & (change > 0.0), zero, 0.0).max(axis=0).clip(0.0, 1.0)
    finish = np.where(moving & (change < 0.0), zero, 1.0).min(axis=0).clip(0.0, 1.0)
    inside = [first + share * change for share in (begin, finish)]
    heights = np.abs(area) / np.maximum(opposite, np.finfo(np.float64).tiny)
    from_border = ((inside[0] + inside[1]) / 2.0 * heights).min(axis=0)
    chosen = np.flatnonzero((begin <= finish) & (from_border > DEEP))
    return Crossings(
        edge=edge.take(chosen, axis=0),
        face=face.take(chosen, axis=0),
        along=np.stack([begin[chosen], finish[chosen]], axis=1),
        inside=np.stack([rows.take(chosen, axis=1).T for rows in inside], axis=1),
    )


def cross(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the cross products of vectors of the picture, (q, 2) each: (q,)."""
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def once(keys: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return keys, at least 0, in rising order, each once; np.unique can take far longer."""
    keys = np.sort(keys)
    return keys[np.diff(keys, prepend=-1) > 0]
