"""How far the normals of visible faces turn, near the attenuation points and elsewhere."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

__all__ = ["bend_of", "normal_changes"]

_NEAR = 1.0
"""A face is near an attenuation point within this distance, in relief units."""


def normal_changes(
    before: NDArray[np.float64],
    after: NDArray[np.float64],
    faces: NDArray[np.int64],
    visible: NDArray[np.bool_],
    points: NDArray[np.int64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Measure how far the normals of visible faces have turned.

    Parameters
    ----------
    before, after : (n, 3) float64
    faces : (m, 3) int64
    visible : (n,) bool
    points : (q,) int64
        The kept attenuation points.

    Returns
    -------
    near, elsewhere : (a,), (b,) float64
        Angles in degrees, near the points and elsewhere; faces without an area are left out.
    """
    seen = faces[visible[faces].all(axis=1)]
    one, other = _normals(before[seen]), _normals(after[seen])
    sizes = np.linalg.norm(one, axis=1) * np.linalg.norm(other, axis=1)
    cosine = (one * other).sum(axis=1)[sizes > 0.0] / sizes[sizes > 0.0]
    angle = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
    middle = before[seen[sizes > 0.0]].mean(axis=1)
    distance, _ = cKDTree(before[points]).query(middle, distance_upper_bound=2.0 * _NEAR)
    return angle[distance <= _NEAR], angle[distance > _NEAR]


def bend_of(
    vertices: NDArray[np.float64],
    z: NDArray[np.float64],
    faces: NDArray[np.int64],
    visible: NDArray[np.bool_],
    points: NDArray[np.int64],
) -> tuple[float, float]:
    """Return the 99th percentile of the angles of `normal_changes`, near the points and elsewhere.

    Parameters
    ----------
    vertices : (n, 3) float64
        Before.
    z : (n,) float64
        Heights after.
    faces : (m, 3) int64
    visible : (n,) bool
    points : (q,) int64

    Returns
    -------
    near, elsewhere : float
        In degrees; 0 where there are no faces.
    """
    after = np.column_stack([vertices[:, :2], z])
    near, elsewhere = normal_changes(vertices, after, faces, visible, points)
    return _most(near), _most(elsewhere)


def _most(angles: NDArray[np.float64]) -> float:
    return float(np.percentile(angles, 99)) if len(angles) else 0.0


def _normals(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
