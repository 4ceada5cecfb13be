"""Surfaces that change places between the lines on which their order is kept."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from o3d_relief.bounds.crossings import crossings, edges_of
from o3d_relief.bounds.pairs import Pairs, foot_pairs, vertex_pairs

__all__ = ["BetweenLines"]

_SAME = 1e-3
"""Relief units below which float32 rays do not tell two surfaces apart."""


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
        self._edges = edges_of(faces)

    def missed_pairs(self, z: NDArray[np.float64]) -> Pairs:
        """Find what crosses where nothing crossed before, or else what has changed places.

        Parameters
        ----------
        z : (n,) float64
            New heights.

        Returns
        -------
        Pairs
            In the order of the original. What lies behind S does not count.
        """
        before = self._vertices[:, 2]
        relief = np.column_stack([self._vertices[:, :2], z])
        met = crossings(relief, self._faces, self._edges)
        new = met.pierced(z) & ~met.pierced(before)
        new &= (z[met.face].max(axis=1) > 0.0) & (z[met.edge].max(axis=1) > 0.0)
        found = met.select(new).pairs(before, z)
        found = found.select(np.maximum(*found.heights(z)) > 0.0)
        if len(found) == 0:
            stacked = vertex_pairs(relief, self._faces)
            gap = np.subtract(*stacked.heights(before))
            inverted = stacked.select(gap < -_SAME)
            turned = Pairs(
                upper=inverted.lower,
                upper_weights=inverted.lower_weights,
                lower=inverted.upper,
                lower_weights=inverted.upper_weights,
                gap=-gap[gap < -_SAME],
            )
            found = Pairs.join([turned, foot_pairs(self._vertices, self._faces, self._edges, z)])
            found = found.select(np.maximum(*found.heights(z)) > 0.0)
        return found
