"""Lines along z through a mesh, and what they meet."""

from __future__ import annotations

from functools import cached_property

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from o3d_relief.rays import unit_box

__all__ = ["MISS", "SAME_PLACE", "UP", "Borders", "Lines", "UnitBox", "upright", "weights_of"]

SAME_PLACE = 5e-4
"""Points of a line that are closer than this, in relief units, are one: rays are cast in float32."""

_UPRIGHT = 0.01
"""Share of its area at which a triangle, seen from the front, counts as upright: there an error of float32 in
x and y is one of more than 1e-3 relief units in z."""

_BLOCK = 16384
"""Triangles that are worked on at once."""

MISS = 0xFFFFFFFF
"""What RaycastingScene calls the triangle that a ray does not meet."""

UP = np.array([0.0, 0.0, 1.0])


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


class Borders:
    """The borders of a mesh, seen from the front: a line that grazes one meets the surface by chance."""

    def __init__(self, vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> None:
        n = len(vertices)
        corners = np.ascontiguousarray(faces.T)
        start, end = corners[[1, 2, 0]], corners[[2, 0, 1]]
        edge = np.minimum(start, end) * n + np.maximum(start, end)
        ordered = np.sort(edge, axis=None)
        alone = np.ones(len(ordered), dtype=bool)
        same = ordered[1:] == ordered[:-1]
        alone[1:] &= ~same
        alone[:-1] &= ~same
        single = ordered[alone]
        at_border = np.zeros(n, dtype=bool)
        at_border[single // n] = True
        at_border[single % n] = True
        self._on_border = at_border[start] & at_border[end]
        likely = edge[self._on_border]
        place = np.minimum(np.searchsorted(single, likely), max(len(single) - 1, 0))
        self._on_border[self._on_border] = single[place] == likely
        self._corner_on_border = at_border[corners]
        x, y = np.ascontiguousarray(vertices[:, :2].T)
        across, along = x[end] - x[start], y[end] - y[start]
        area = np.abs(across[0] * along[1] - along[0] * across[1])
        opposite = np.sqrt(across**2 + along**2)
        self._height = area / np.maximum(opposite, np.finfo(np.float64).tiny)

    def grazed(self, triangle: NDArray[np.int64], weights: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Tell which points of triangles, (q,) and (q, 3), lie on a border, to a rounding error."""
        near = [
            own * height[triangle] < 2 * SAME_PLACE
            for own, height in zip(weights.T, self._height, strict=True)
        ]
        grazed = np.zeros(len(triangle), dtype=bool)
        for side in range(3):
            at_corner = near[side - 2] & near[side - 1]
            grazed |= near[side] & self._on_border[side][triangle]
            grazed |= at_corner & self._corner_on_border[side][triangle]
        return grazed


class UnitBox:
    """A mesh in the unit box, and rays of one direction through it."""

    def __init__(self, vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> None:
        self.scene, self.middle, self.size = unit_box(vertices, faces)

    def rays(self, origins: NDArray[np.float64], direction: NDArray[np.float64]) -> o3d.core.Tensor:
        """Return rays from origins (q, 3), of the mesh's frame, in one direction (3,)."""
        rays = np.zeros((len(origins), 6), dtype=np.float32)
        rays[:, :3] = (origins - self.middle) / self.size
        rays[:, 3:] = direction
        return o3d.core.Tensor(rays)


class Lines:
    """What lines along z meet in points: the faces of a mesh that do not stand upright.

    Everything is made when it is needed, and once for all who cast lines through the mesh.

    Parameters
    ----------
    vertices : (n, 3) float64
        In the relief frame, in relief units.
    faces : (m, 3) int64

    Attributes
    ----------
    vertices : (n, 3) float64
    faces : (l, 3) int64
    box : UnitBox
    borders : Borders
    """

    def __init__(self, vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> None:
        self.vertices, self._all = vertices, faces

    @cached_property
    def faces(self) -> NDArray[np.int64]:
        """The faces that do not stand upright."""
        return self._all[~upright(self.vertices, self._all)]

    @cached_property
    def box(self) -> UnitBox:
        """Their scene."""
        return UnitBox(self.vertices, self.faces)

    @cached_property
    def borders(self) -> Borders:
        """Their borders."""
        return Borders(self.vertices, self.faces)


def weights_of(uv: NDArray[np.float32]) -> NDArray[np.float64]:
    """Return the barycentric coordinates (q, 3) of what rays have met, from two of them (q, 2)."""
    u, v = uv.astype(np.float64).T
    return np.stack([1.0 - u - v, u, v], axis=1)
