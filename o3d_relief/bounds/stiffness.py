"""The surface made stiffer around the attenuation points, so that it bends further away from them."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from o3d_relief.linalg.laplacian import cotangent_laplacian

__all__ = ["REACH", "Stiffness"]

REACH = 2.0
"""Distance from the points at which the surface is as soft as elsewhere, in relief units: twice that within
which nothing shall bend."""


class Stiffness:
    """What the faces around some points add to the Dirichlet energy of a displacement.

    Parameters
    ----------
    vertices : (n, 3) float64
        Original positions, in relief units.
    faces : (m, 3) int64
    distance : (m,) float64
        Of the middle of each face from the points, in relief units.

    Attributes
    ----------
    within : (n,) bool
        The vertices of these faces.
    """

    def __init__(
        self, vertices: NDArray[np.float64], faces: NDArray[np.int64], distance: NDArray[np.float64]
    ) -> None:
        near = distance < REACH
        weights = (1.0 - (distance[near] / REACH) ** 2) ** 2
        self._form, _ = cotangent_laplacian(vertices, faces[near], weights=weights)
        self.within = np.zeros(len(vertices), dtype=bool)
        self.within[faces[near]] = True

    def added_to(self, laplacian: sp.csr_array, factor: float) -> sp.csr_array:
        """Return the Laplacian with each face weighted by 1 + factor (1 - (r / reach)^2)^2.

        Parameters
        ----------
        laplacian : (n, n) sparse float64
            C.
        factor : float
            0 leaves it as it is.

        Returns
        -------
        (n, n) sparse float64
        """
        return (laplacian + factor * self._form).tocsr()
