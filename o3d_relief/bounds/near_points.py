"""The surface near the attenuation points."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from o3d_relief.bounds.bends import Bends
from o3d_relief.bounds.stiffness import REACH, Stiffness

__all__ = ["NearPoints"]


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
        a, b, c = (self._vertices.take(corner, axis=0) for corner in self._faces.T)
        tree = cKDTree(self._vertices[self._index])
        distance, _ = tree.query((a + b + c) / 3.0, distance_upper_bound=REACH)
        return np.asarray(distance)

    @cached_property
    def stiffness(self) -> Stiffness:
        """What makes the surface stiffer there."""
        return Stiffness(self._vertices, self._faces, self._distance)

    @cached_property
    def bends(self) -> Bends:
        """What measures how far it bends there and elsewhere."""
        return Bends(self._vertices, self._faces, self._visible, self._distance)
