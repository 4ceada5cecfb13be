"""What of a surface is seen, and what changes of it would show."""

from __future__ import annotations

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from o3d_relief.rays import unit_box

__all__ = ["face_weights", "seen_faces", "seen_points"]

_STEEP = 0.3
"""Weight of the steepest triangles that are seen: they may turn most, but they are no free hinges."""

_SHALLOW = 0.5
"""The same at next to no depth."""

_HIDDEN = 0.05
"""Weight of what is not seen."""

_MISS = 0xFFFFFFFF


def seen_points(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], *, side: int = 1024
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Find the points of the surface that are seen from the front, on a regular grid.

    Parameters
    ----------
    vertices : (n, 3) float64
        In the relief frame.
    faces : (m, 3) int64
    side : int
        Number of points along x and along y.

    Returns
    -------
    face : (q,) int64
        The face of each point.
    weights : (q, 3) float64
        Barycentric coordinates, at least 0.
    """
    scene, middle, size = unit_box(vertices, faces)
    low, high = (vertices.min(axis=0) - middle) / size, (vertices.max(axis=0) - middle) / size
    steps = (np.arange(side) + 0.5) / side
    x, y = np.meshgrid(low[0] + steps * (high[0] - low[0]), low[1] + steps * (high[1] - low[1]))
    rays = np.zeros((side * side, 6), dtype=np.float32)
    rays[:, 0], rays[:, 1], rays[:, 2] = x.ravel(), y.ravel(), high[2] + 1.0
    rays[:, 5] = -1.0
    hits = scene.cast_rays(o3d.core.Tensor(rays))
    face = hits["primitive_ids"].numpy()
    hit = face != _MISS
    u, v = hits["primitive_uvs"].numpy()[hit].astype(np.float64).T
    weights = np.clip(np.stack([1.0 - u - v, u, v], axis=1), 0.0, 1.0)
    return face[hit].astype(np.int64), weights / weights.sum(axis=1, keepdims=True)


def seen_faces(
    faces: NDArray[np.int64], visible: NDArray[np.bool_], face_of_point: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Tell which faces are seen: those with a visible vertex or a seen point, (m,)."""
    seen: NDArray[np.bool_] = np.array(visible[faces].any(axis=1))
    seen[face_of_point] = True
    return seen


def face_weights(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], seen: NDArray[np.bool_], share: float
) -> NDArray[np.float64]:
    """Weigh each triangle by how much a change of it shows.

    The slope of a steep triangle may change much before its normal does: its weight is sqrt(n_z^2 + s^2),
    about the share n_z of its area that is seen, and at least s. The force that flattens a surface is much
    the same all over it: what is softer than the rest gives in until it is level or leans the other way, and
    narrow steep bands (the jaw of a face) become clefts or bright rims. The shallower the relief, the larger
    the force: s is 0.5 less the relief's share of the scene's depth, and at least 0.3. What is hidden takes
    the rest, with a weight of 0.05: nobody sees it bend.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int64
    seen : (m,) bool
    share : float
        Depth of the relief, as a share of that of the scene.

    Returns
    -------
    (m,) float64
    """
    steepest = max(_STEEP, _SHALLOW - share)
    a, b, c = vertices[faces].transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    size = np.linalg.norm(normal, axis=1)
    towards = np.abs(normal[:, 2]) / np.where(size > 0.0, size, 1.0)
    return np.where(seen, np.hypot(towards, steepest), _HIDDEN)
