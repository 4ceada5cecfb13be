"""Surfaces that crossed in the scene, and have passed through each other since."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from o3d_relief.bounds.crossings import Crossings, crossings, edges_of
from o3d_relief.bounds.new_crossings import around
from o3d_relief.bounds.pairs import Pairs
from o3d_relief.bounds.raster import Raster

__all__ = ["Parted"]

_APART = 1e-3
"""Relief units by which surfaces that are in an order are apart somewhere."""


class Parted:
    """Looks beside crossings of the parts of a scene that are gone, where triangles may have changed places.

    A part of the picture in which two surfaces have changed places may end where they crossed in the scene.
    Where they cross no longer, all of it lies within triangles, and neither vertices nor silhouettes nor
    edges that pierce triangles now tell of it.

    Parameters
    ----------
    vertices : (n, 3) float64
        Of the scene, in relief units.
    faces : (m, 3) int64
    laplacian : (n, n) sparse float64
        What hangs together in it is a part.
    raster : Raster
        Of the faces.
    """

    def __init__(
        self,
        vertices: NDArray[np.float64],
        faces: NDArray[np.int64],
        laplacian: sp.csr_array,
        raster: Raster,
    ) -> None:
        self._vertices, self._faces = vertices, faces
        self._old = self._between_parts(laplacian, raster)
        self.forget()

    def forget(self) -> None:
        """Look everywhere the next time."""
        self._last = np.full(len(self._vertices), np.nan)

    def look_at(self, z: NDArray[np.float64]) -> Pairs:
        """Return what lies right beside crossings that are gone for the heights z (n,).

        Upper and lower as they were in the scene; only where something has moved since the last call.
        """
        if len(self._old) == 0:
            return Pairs.join([])
        moved = z != self._last
        self._last = z
        beside = np.zeros(len(z), dtype=bool)
        beside[self._faces[moved[self._faces].any(axis=1)]] = True
        edge, face = self._old.edge, self._old.face
        looked = beside[edge].any(axis=1) | beside[face].any(axis=1)
        looked &= (z[edge].max(axis=1) > 0.0) & (z[face].max(axis=1) > 0.0)
        old = self._old.select(np.flatnonzero(looked))
        gone = old.select(~old.pierced(z))
        if len(gone) == 0:
            return Pairs.join([])
        before = self._vertices[:, 2]
        near = around(gone, self._vertices, self._faces, uncrossed=True)
        apart = ~near.pierced(before) & (np.abs(near.gaps(before)).max(axis=1) > _APART)
        return near.select(apart).pairs(before, z)

    def _between_parts(self, laplacian: sp.csr_array, raster: Raster) -> Crossings:
        """Find the edges that pierce triangles in the scene, near all parts but the largest."""
        vertices, faces = self._vertices, self._faces
        count, label = connected_components(laplacian, directed=False)
        if count == 1:
            return crossings(vertices, faces[:0], edges_of(faces[:0]))
        smaller = (label != np.bincount(label).argmax())[faces[:, 0]]
        near = faces[raster.over_or_under(smaller)]
        found = crossings(vertices, near, edges_of(near))
        return found.select(found.pierced(vertices[:, 2]))
