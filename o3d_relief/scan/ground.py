"""The floor or the table on which a scanned object stands."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from o3d_relief.errors import MeshError

__all__ = ["find_ground"]

_LEVEL = 0.9
"""Cosine between `up` and the normals of points that may lie on the ground: 25 degrees."""

_THICK = 2.0
"""Points within so many spacings of the plane lie on it."""

_SAMPLE = 50_000
"""Points among which the plane is searched."""

_LEAST = 0.03
"""Share of all points that makes a plane a ground."""


def find_ground(
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    up: NDArray[np.float64],
    spacing: float,
    *,
    seed: int,
) -> NDArray[np.bool_]:
    """Find the points of the largest level plane, and those below it.

    RANSAC (Fischler and Bolles 1981) on the points whose normals are level.

    Parameters
    ----------
    points : (n, 3) float64
    normals : (n, 3) float64
        Unit vectors, pointing either way.
    up : (3,) float64
        Unit vector.
    spacing : float
        In the unit of the points.
    seed : int

    Returns
    -------
    (n,) bool

    Raises
    ------
    MeshError
        There is no level plane with a few percent of the points.
    """
    from sklearn.linear_model import RANSACRegressor

    level = np.flatnonzero(np.abs(normals @ up) >= _LEVEL)
    axis = np.eye(3)[np.argmin(np.abs(up))]
    right = np.cross(axis, up)
    right /= np.linalg.norm(right)
    frame = np.stack([right, np.cross(up, right), up], axis=1)
    turned = points @ frame
    chosen = level[:: max(1, len(level) // _SAMPLE)]
    found = np.zeros(len(points), dtype=bool)
    if len(chosen) >= 10:
        search = RANSACRegressor(
            residual_threshold=_THICK * spacing, min_samples=3, max_trials=500, random_state=seed
        )
        search.fit(turned[chosen, :2], turned[chosen, 2])
        above = turned[:, 2] - search.predict(turned[:, :2])
        on_plane = np.zeros(len(points), dtype=bool)
        on_plane[level] = np.abs(above[level]) <= _THICK * spacing
        if on_plane.sum() >= _LEAST * len(points):
            found = above <= _THICK * spacing
    if not found.any():
        raise MeshError(
            "No ground was found: no level plane holds a few percent of the points. Leave it, or give the "
            "direction that points up."
        )
    if found.all():
        raise MeshError("Nothing but ground was found: all points lie on one level plane or below it.")
    return found
