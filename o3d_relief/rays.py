"""Open3D's RaycastingScene, used as it has to be: it computes in float32."""

from __future__ import annotations

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

__all__ = ["unit_box"]


def unit_box(
    vertices: NDArray[np.float64], faces: NDArray[np.int64]
) -> tuple[o3d.t.geometry.RaycastingScene, NDArray[np.float64], float]:
    """Build a RaycastingScene around a mesh, brought into the unit box because it computes in float32.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int64

    Returns
    -------
    scene : RaycastingScene
    middle : (3,) float64
    size : float
        The point p lies at (p - middle) / size in the scene.
    """
    axes = np.ascontiguousarray(vertices.T)
    low, high = axes.min(axis=1), axes.max(axis=1)
    middle, size = (low + high) / 2, float((high - low).max())
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(
        o3d.core.Tensor(((vertices - middle) / size).astype(np.float32)),
        o3d.core.Tensor(faces.astype(np.uint32)),
    )
    return scene, middle, size
