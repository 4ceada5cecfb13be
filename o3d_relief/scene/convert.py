"""Open3D meshes to arrays and back: the border at which meshes are checked once."""

from __future__ import annotations

import numpy as np
import open3d as o3d
from numpy.typing import ArrayLike, NDArray

from o3d_relief.errors import MeshError

__all__ = ["arrays_mesh", "mesh_arrays"]


def mesh_arrays(mesh: o3d.geometry.TriangleMesh) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Copy vertices and faces out of an Open3D mesh and check them.

    Parameters
    ----------
    mesh : open3d.geometry.TriangleMesh
        Never modified.

    Returns
    -------
    vertices : (n, 3) float64
    faces : (m, 3) int64

    Raises
    ------
    MeshError
        Not a TriangleMesh, no vertices, no triangles, vertices of faces that are not finite, or indices
        out of range.
    """
    if not isinstance(mesh, o3d.geometry.TriangleMesh):
        kind = f"{type(mesh).__module__}.{type(mesh).__qualname__}"
        raise MeshError(f"The scene must be an open3d.geometry.TriangleMesh. Got a {kind} instead.")
    vertices = np.array(mesh.vertices, dtype=np.float64).reshape(-1, 3)
    faces = np.array(mesh.triangles, dtype=np.int64).reshape(-1, 3)
    if len(vertices) == 0:
        raise MeshError("The mesh is empty: it has no vertices.")
    if len(faces) == 0:
        raise MeshError(f"The mesh has no triangles, only {len(vertices)} vertices: it must be meshed first.")
    low, high = int(faces.min()), int(faces.max())
    if low < 0 or high >= len(vertices):
        wrong = low if low < 0 else high
        raise MeshError(
            f"A triangle names vertex {wrong}, but the mesh has the vertices 0 to {len(vertices) - 1}: "
            "the mesh is damaged."
        )
    bad = int((~np.isfinite(vertices[faces]).all(axis=(1, 2))).sum())
    if bad:
        raise MeshError(
            f"The mesh has vertices that are not finite numbers, in {bad} of its {len(faces)} triangles: "
            "remove these first."
        )
    return vertices, faces


def arrays_mesh(vertices: ArrayLike, faces: ArrayLike) -> o3d.geometry.TriangleMesh:
    """Copy vertices and faces into an Open3D mesh.

    Parameters
    ----------
    vertices : (n, 3) float
    faces : (m, 3) int

    Raises
    ------
    MeshError
        Arrays of other shapes.
    """
    places, corners = np.asarray(vertices, dtype=np.float64), np.asarray(faces)
    for name, array in (("vertices", places), ("faces", corners)):
        if array.ndim != 2 or array.shape[1] != 3:
            raise MeshError(f"{name} must be of the shape (count, 3). Got {array.shape} instead.")
    return o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector(places), o3d.utility.Vector3iVector(corners.astype(np.int32))
    )
