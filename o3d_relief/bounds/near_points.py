"""The surface near the attenuation points."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from o3d_relief.bounds.bends import Bends
from o3d_relief.bounds.stiffness import REACH, Stiffness

__all__ = ["NearPoints"]

_MOST_CELLS = 128
"""Cells, along the longest side, in which faces near the points are looked up."""


class NearPoints:
    """How stiff a surface is near some points, and how far it bends there; each made when it is needed.

    Parameters
    ----------
    vertices : (n, 3) float64
        Original positions, in relief units.
    faces : (m, 3) int64
    visible : (n,) bool
    index : (q,) int64
        The kept attenuation points.

    Attributes
    ----------
    stiffness : Stiffness
    bends : Bends
    """

    def __init__(
        self,
        vertices: NDArray[np.float64],
        faces: NDArray[np.int64],
        visible: NDArray[np.bool_],
        index: NDArray[np.int64],
    ) -> None:
        self._vertices, self._faces, self._visible, self._index = vertices, faces, visible, index

    @cached_property
    def _distance(self) -> NDArray[np.float64]:
        """The distance of the middle of each face from the points, infinite beyond the reach of stiffness."""
        places, points = np.ascontiguousarray(self._vertices.T), self._vertices[self._index]
        a, b, c = np.ascontiguousarray(self._faces.T)
        middle = [(axis[a] + axis[b] + axis[c]) / 3.0 for axis in places]
        chosen = _next_to(middle, points)
        distance = np.full(len(self._faces), np.inf)
        distance[chosen], _ = cKDTree(points).query(
            np.stack([axis[chosen] for axis in middle], axis=1), distance_upper_bound=REACH
        )
        return distance

    @cached_property
    def stiffness(self) -> Stiffness:
        """What makes the surface stiffer there."""
        return Stiffness(self._vertices, self._faces, self._distance)

    @cached_property
    def bends(self) -> Bends:
        """What measures how far it bends there and elsewhere."""
        return Bends(self._vertices, self._faces, self._visible, self._distance)


def _next_to(middle: list[NDArray[np.float64]], points: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return the numbers of places, three times (m,), in or next to the cells of points (q, 3)."""
    low = np.array([axis.min() for axis in middle])
    extent = np.array([np.ptp(axis) for axis in middle])
    cell = max(REACH, float(extent.max()) / _MOST_CELLS)
    near = np.zeros((extent / cell).astype(np.int64) + 5, dtype=bool)
    # A point may lie beside the middles of all faces, but less than a cell: others are next to none.
    own = np.floor((points - low) / cell).astype(np.int64) + 2
    x, y, z = own[((own >= 1) & (own < np.array(near.shape) - 1)).all(axis=1)].T
    for right, above, front in np.ndindex(3, 3, 3):
        near[x + right - 1, y + above - 1, z + front - 1] = True
    column = [((axis - start) / cell).astype(np.int32) + 2 for axis, start in zip(middle, low, strict=True)]
    return np.flatnonzero(near[tuple(column)])
