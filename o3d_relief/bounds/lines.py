"""Lines along z through a mesh, and what they meet."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from o3d_relief.bounds.borders import SAME_PLACE, Borders
from o3d_relief.rays import FROM, UP, UnitBox

__all__ = ["FROM", "MISS", "SAME_PLACE", "UP", "Borders", "Hits", "Lines", "upright", "weights_of"]

_UPRIGHT = 0.01
"""Share of its area at which a triangle, seen from the front, counts as upright: there an error of float32 in
x and y is one of more than 1e-3 relief units in z."""

_BLOCK = 16384
"""Triangles that are worked on at once."""

_FEW = 1000
"""Rays that meet what stands upright up to which all that they meet is listed."""

MISS = 0xFFFFFFFF
"""What RaycastingScene calls the triangle that a ray does not meet."""


def upright(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Find the triangles that stand on S within half a degree: where a line meets them is chance.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int64

    Returns
    -------
    (m,) bool
        Those without an area, too.
    """
    places, corners = np.ascontiguousarray(vertices.T), np.ascontiguousarray(faces.T)
    standing = np.zeros(len(faces), dtype=bool)
    for begin in range(0, len(faces), _BLOCK):
        a, b, c = corners[:, begin : begin + _BLOCK]
        (ux, uy, uz), (vx, vy, vz) = (places[:, end] - places[:, a] for end in (b, c))
        x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        standing[begin : begin + _BLOCK] = np.abs(z) <= _UPRIGHT * np.sqrt(x**2 + y**2 + z**2)
    return standing


@dataclass(frozen=True, kw_only=True, eq=False)
class Hits:
    """What rays have met first.

    Attributes
    ----------
    ray : (h,) int64
        Numbers of the rays that have met anything, rising.
    triangle : (h,) int64
    weights : (h, 3) float64
        Barycentric coordinates in it.
    distance : (h,) float64
        From where the ray begins, in relief units.
    """

    ray: NDArray[np.int64]
    triangle: NDArray[np.int64]
    weights: NDArray[np.float64]
    distance: NDArray[np.float64]

    def select(self, number: NDArray[np.int64]) -> Hits:
        """Return some of them, by number."""
        return Hits(
            ray=self.ray.take(number),
            triangle=self.triangle.take(number),
            weights=self.weights.take(number, axis=0),
            distance=self.distance.take(number),
        )

    def of(self, numbers: NDArray[np.int64]) -> Hits:
        """Return the same with other numbers of the rays: those at these places of a list, rising."""
        return Hits(
            ray=numbers[self.ray], triangle=self.triangle, weights=self.weights, distance=self.distance
        )

    def joined(self, other: Hits) -> Hits:
        """Return both, by rising ray."""
        everything = Hits(
            ray=np.concatenate([self.ray, other.ray]),
            triangle=np.concatenate([self.triangle, other.triangle]),
            weights=np.concatenate([self.weights, other.weights]),
            distance=np.concatenate([self.distance, other.distance]),
        )
        return everything.select(np.argsort(everything.ray, kind="stable"))


class Lines:
    """What lines along z meet in points: the faces of a mesh that do not stand upright.

    Everything is made when it is needed, and once for all who cast lines through the mesh.

    Parameters
    ----------
    vertices : (n, 3) float64
        In the relief frame, in relief units.
    faces : (m, 3) int64
    box : UnitBox, optional
        All of the mesh, upright faces as well, where that is at hand already.

    Attributes
    ----------
    vertices : (n, 3) float64
    faces : (l, 3) int64
    borders : Borders
    size : float
        The largest extent of the mesh, in relief units.
    above, below : Hits
        What the lines through the vertices meet first, from 5e-5 relief units above or below them on.
    """

    def __init__(
        self, vertices: NDArray[np.float64], faces: NDArray[np.int64], box: UnitBox | None = None
    ) -> None:
        self.vertices, self._all, self._given = vertices, faces, box

    @cached_property
    def _lying(self) -> NDArray[np.bool_]:
        return ~upright(self.vertices, self._all)

    @cached_property
    def faces(self) -> NDArray[np.int64]:
        """The faces that do not stand upright."""
        return self._all[self._lying]

    @cached_property
    def _box(self) -> UnitBox:
        return UnitBox(self.vertices, self.faces) if self._given is None else self._given

    @cached_property
    def _lying_box(self) -> UnitBox:
        return UnitBox(self.vertices, self.faces)

    @cached_property
    def _number(self) -> NDArray[np.int64]:
        """The number of each face of the box among those that do not stand upright, -1 for the others."""
        if self._given is None:
            return np.arange(len(self.faces))
        return np.where(self._lying, np.cumsum(self._lying) - 1, -1)

    @property
    def size(self) -> float:
        """The largest extent."""
        return self._box.size

    @cached_property
    def borders(self) -> Borders:
        """Their borders."""
        return Borders(self.vertices, self.faces)

    @cached_property
    def above(self) -> Hits:
        """What is met first above the vertices."""
        return self._nearest(self._box.above, self.vertices + FROM * UP, UP)

    @cached_property
    def below(self) -> Hits:
        """What is met first below the vertices."""
        return self.first(self.vertices - FROM * UP, -UP)

    def first(self, origins: NDArray[np.float64], direction: NDArray[np.float64]) -> Hits:
        """Return what is met first from origins (q, 3) on, in one direction along z."""
        answer = self._box.scene.cast_rays(self._box.rays(origins, direction))
        return self._nearest(answer, origins, direction)

    def _nearest(
        self,
        answer: dict[str, o3d.core.Tensor],
        origins: NDArray[np.float64],
        direction: NDArray[np.float64],
    ) -> Hits:
        """Return the nearest hits of faces that do not stand upright, by what rays met first of all."""
        found = _read(answer, self._number, self.size)
        standing = found.triangle < 0
        if not standing.any():
            return found
        others = found.select(np.flatnonzero(~standing))
        if len(self.faces) == 0:
            return others
        # Behind what stands upright may be what is met first. For a few rays all that is met is listed, which
        # needs no other scene. It would be too much where a wall is a little rough: every other of its
        # vertices has half of the wall above it.
        ray = found.ray[standing]
        if len(ray) <= _FEW:
            return others.joined(_first_of_each(self.all(origins[ray], direction)).of(ray))
        box = self._lying_box
        answer = box.scene.cast_rays(box.rays(origins[ray], direction))
        return others.joined(_read(answer, np.arange(len(self.faces)), box.size).of(ray))

    def all(self, origins: NDArray[np.float64], direction: NDArray[np.float64]) -> Hits:
        """Return all that is met from origins (q, 3) on, in one direction along z, by ray, in no order."""
        answer = self._box.scene.list_intersections(self._box.rays(origins, direction))
        found = _read(answer, self._number, self.size)
        return found.select(np.flatnonzero(found.triangle >= 0))


def _first_of_each(hits: Hits) -> Hits:
    """Return the nearest hit of each ray, by rising ray."""
    order = np.lexsort((hits.distance, hits.ray))
    return hits.select(order[np.diff(hits.ray[order], prepend=-1) > 0])


def _read(answer: dict[str, o3d.core.Tensor], number: NDArray[np.int64], size: float) -> Hits:
    """Read what a scene of a size answers, whose faces have these numbers."""
    triangle = answer["primitive_ids"].numpy()
    met = np.flatnonzero(triangle != MISS)
    return Hits(
        ray=answer["ray_ids"].numpy()[met].astype(np.int64) if "ray_ids" in answer else met,
        triangle=number[triangle[met].astype(np.int64)],
        weights=weights_of(answer["primitive_uvs"].numpy()[met]),
        distance=answer["t_hit"].numpy()[met].astype(np.float64) * size,
    )


def weights_of(uv: NDArray[np.float32]) -> NDArray[np.float64]:
    """Return the barycentric coordinates (q, 3) of what rays have met, from two of them (q, 2)."""
    u, v = uv.astype(np.float64).T
    return np.stack([1.0 - u - v, u, v], axis=1)
