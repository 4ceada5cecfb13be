"""Surfaces that crossed in the scene, and have passed through each other since."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from o3d_relief.bounds.crossings import Crossings, around, crossings, edges_of
from o3d_relief.bounds.pairs import Pairs
from o3d_relief.bounds.raster import Raster

__all__ = ["Parted"]

_APART = 1e-3
"""Relief units by which surfaces that are in an order are apart somewhere."""


class Parted:
    """Looks for triangles that changed places right beside a crossing of parts of the scene that is gone.

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
        self._laplacian, self._raster = laplacian, raster
        self._old: Crossings | None = None

    def look_at(self, z: NDArray[np.float64]) -> Pairs:
        """Return pairs, in the order of the scene, of what lies the other way round for the heights z (n,)."""
        if self._old is None:
            self._old = self._between_parts()
        before = self._vertices[:, 2]
        in_front = (z[self._old.face].max(axis=1) > 0.0) & (z[self._old.edge].max(axis=1) > 0.0)
        gone = self._old.select(in_front & ~self._old.pierced(z))
        if len(gone) == 0:
            return Pairs.join([])
        beside = around(gone, self._vertices, self._faces, uncrossed=True)
        apart = ~beside.pierced(before) & (np.abs(beside.gaps(before)).max(axis=1) > _APART)
        return beside.select(apart).pairs(before, z)

    def _between_parts(self) -> Crossings:
        """Find the edges that pierce triangles in the scene, near all parts but the largest."""
        vertices, faces = self._vertices, self._faces
        _, label = connected_components(self._laplacian, directed=False)
        smaller = (label != np.bincount(label).argmax())[faces[:, 0]]
        near = faces[self._raster.over_or_under(smaller)]
        found = crossings(vertices, near, edges_of(near))
        return found.select(found.pierced(vertices[:, 2]))
