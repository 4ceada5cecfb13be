"""A mesh that is prepared once and then changed in place."""

from __future__ import annotations

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from o3d_relief.show.normals import crease_normals

__all__ = ["DIMMED", "LiveMesh"]

DIMMED = 0.74
"""Colours are darkened by this: the four lamps of Open3D's visualizer burn out light ones."""

_CREASE = 50.0  # degrees, as in the pictures
_APART = 0.985
"""Corners whose normals differ more (cosine of 10 degrees) from the mean of their vertex are split off."""


class LiveMesh:
    """An Open3D mesh over fixed faces.

    Vertices at creases are split once, so that sharp edges stay sharp in a window that shades smoothly.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int64
    normals : (n, 3) float64, optional
        Taken as they are, instead of splitting and computing them.

    Attributes
    ----------
    mesh : open3d.geometry.TriangleMesh
    """

    def __init__(
        self,
        vertices: NDArray[np.float64],
        faces: NDArray[np.int64],
        normals: NDArray[np.float64] | None = None,
    ) -> None:
        self._origin, corners = np.arange(len(vertices)), faces
        if normals is None:
            self._origin, corners = _split(vertices, faces)
        self.mesh = o3d.geometry.TriangleMesh(
            o3d.utility.Vector3dVector(vertices[self._origin]),
            o3d.utility.Vector3iVector(corners.astype(np.int32)),
        )
        self.mesh.vertex_colors = o3d.utility.Vector3dVector(np.full((len(self._origin), 3), 0.8))
        if normals is None:
            self.mesh.compute_vertex_normals()
        else:
            self.mesh.compute_triangle_normals()  # the visualizer lights no mesh without them
            self.mesh.vertex_normals = o3d.utility.Vector3dVector(normals)

    def move(self, vertices: NDArray[np.float64]) -> None:
        """Put the vertices (n, 3) elsewhere."""
        np.asarray(self.mesh.vertices)[:] = vertices[self._origin]
        self.mesh.compute_vertex_normals()

    def paint(self, colors: NDArray[np.float64]) -> None:
        """Give the vertices other colours (n, 3), sRGB in [0, 1]."""
        np.asarray(self.mesh.vertex_colors)[:] = DIMMED * colors[self._origin]


def _split(
    vertices: NDArray[np.float64], faces: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the vertex (d,) that each split vertex was, and the faces (m, 3) over the split ones."""
    edges = vertices[faces[:, 1:]] - vertices[faces[:, :1]]
    cross = np.cross(edges[:, 0], edges[:, 1])
    area = np.linalg.norm(cross, axis=1)
    flat = area <= 0.0
    normals = (cross / np.where(flat, 1.0, area)[:, None]).astype(np.float32)
    wanted = crease_normals(vertices, faces, normals, _CREASE).reshape(-1, 3)
    corner = faces.ravel()
    total = np.column_stack([np.bincount(corner, wanted[:, c], len(vertices)) for c in range(3)])
    mean = total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-12)
    apart = np.flatnonzero((np.einsum("ij,ij->i", wanted, mean[corner]) < _APART) & ~np.repeat(flat, 3))
    key = np.column_stack([corner[apart], np.rint(wanted[apart] * 16.0).astype(np.int64)])
    groups, number = np.unique(key, axis=0, return_inverse=True)
    split = corner.copy()
    split[apart] = len(vertices) + number.ravel()
    return np.concatenate([np.arange(len(vertices)), groups[:, 0]]), split.reshape(-1, 3)
