"""Open3D's RaycastingScene, used as it has to be: it computes in float32."""

from __future__ import annotations

from functools import cached_property

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

__all__ = ["FROM", "UP", "UnitBox", "unit_box"]

FROM = 5e-5
"""Where rays begin above or below a vertex, in relief units: right at it they meet its own triangles."""

UP = np.array([0.0, 0.0, 1.0])


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


class UnitBox:
    """A mesh in the unit box, and rays of one direction through it.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int64

    Attributes
    ----------
    scene, middle, size
        See `unit_box`.
    above
        Found when it is first asked for.
    """

    def __init__(self, vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> None:
        self.scene, self.middle, self.size = unit_box(vertices, faces)
        self._vertices = vertices

    @cached_property
    def above(self) -> dict[str, o3d.core.Tensor]:
        """What rays upwards from `FROM` above the vertices meet first, as the scene answers."""
        answer: dict[str, o3d.core.Tensor] = self.scene.cast_rays(self.rays(self._vertices + FROM * UP, UP))
        return answer

    def rays(self, origins: NDArray[np.float64], direction: NDArray[np.float64]) -> o3d.core.Tensor:
        """Return rays from origins (q, 3), of the mesh's frame, in one direction (3,)."""
        rays = np.zeros((len(origins), 6), dtype=np.float32)
        rays[:, :3] = (origins - self.middle) / self.size
        rays[:, 3:] = direction
        return o3d.core.Tensor(rays)
