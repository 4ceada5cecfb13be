"""How far the normals of visible faces turn, near the attenuation points and elsewhere."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["Bends"]

_NEAR = 1.0
"""A face is near an attenuation point within this distance, in relief units."""


class Bends:
    """Measures how far the normals of visible faces turn where only z moves.

    Parameters
    ----------
    vertices : (n, 3) float64
        Before.
    faces : (m, 3) int64
    visible : (n,) bool
    distance : (m,) float64
        Of the middle of each face from the attenuation points, in relief units.
    """

    def __init__(
        self,
        vertices: NDArray[np.float64],
        faces: NDArray[np.int64],
        visible: NDArray[np.bool_],
        distance: NDArray[np.float64],
    ) -> None:
        a, b, c = faces.T
        seen = np.flatnonzero(visible[a] & visible[b] & visible[c])
        x, y, z = np.ascontiguousarray(vertices.T)
        self._corners = a, b, c = np.ascontiguousarray(faces.take(seen, axis=0).T)
        self._sides = x[b] - x[a], y[b] - y[a], x[c] - x[a], y[c] - y[a]
        self._before = self._normals(z)
        self._near = distance[seen] <= _NEAR

    def _normals(self, z: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
        """Return the normals of the faces, as long as twice their areas, and their lengths."""
        a, b, c = self._corners
        (ux, uy, vx, vy), uz, vz = self._sides, z[b] - z[a], z[c] - z[a]
        normal = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        return *normal, np.sqrt(normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2)

    def angles(self, z: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Measure how far the normals have turned for the heights z (n,).

        Returns
        -------
        near, elsewhere : (a,), (b,) float64
            Angles in degrees, near the points and elsewhere; faces without an area are left out.
        """
        *one, size = self._before
        *other, new_size = self._normals(z)
        sizes = size * new_size
        dot = one[0] * other[0] + one[1] * other[1] + one[2] * other[2]
        near, elsewhere = (
            np.degrees(np.arccos(np.clip(dot[chosen] / sizes[chosen], -1.0, 1.0)))
            for chosen in (self._near & (sizes > 0.0), ~self._near & (sizes > 0.0))
        )
        return near, elsewhere

    def most(self, z: NDArray[np.float64]) -> tuple[float, float]:
        """Return the 99th percentiles of both `angles`, 0 where there are no faces."""
        near, elsewhere = (
            float(np.percentile(angles, 99)) if len(angles) else 0.0 for angles in self.angles(z)
        )
        return near, elsewhere
