"""Open3D meshes to arrays and back: the border at which meshes are checked once."""

from __future__ import annotations

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from o3d_relief.errors import MeshError

__all__ = ["mesh_arrays", "trimmed_mesh"]

from o3d_relief.stages.trim import Trimmed


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
        raise MeshError(
            f"The scene must be an open3d.geometry.TriangleMesh. Got {type(mesh).__name__} instead."
        )
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
        raise MeshError(f"{bad} triangles have vertices that are not finite numbers: remove them first.")
    return vertices, faces


def trimmed_mesh(mesh: o3d.geometry.TriangleMesh, trimmed: Trimmed) -> o3d.geometry.TriangleMesh:
    """Build the output mesh and carry the input's attributes over to it.

    Vertex colours and triangle UVs are interpolated along the cut, textures and material ids kept, and
    vertex normals computed anew.

    Parameters
    ----------
    mesh : open3d.geometry.TriangleMesh
        The input, whose vertex and triangle numbers `trimmed` refers to.
    trimmed : Trimmed

    Returns
    -------
    open3d.geometry.TriangleMesh
    """
    result = o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector(trimmed.vertices),
        o3d.utility.Vector3iVector(trimmed.faces.astype(np.int32)),
    )
    faces = np.asarray(mesh.triangles, dtype=np.int64)
    if mesh.has_vertex_colors():
        colors = trimmed.to_vertices(np.asarray(mesh.vertex_colors))
        result.vertex_colors = o3d.utility.Vector3dVector(colors)
    if mesh.has_triangle_uvs():
        uvs = trimmed.to_corners(faces, np.asarray(mesh.triangle_uvs).reshape(-1, 3, 2))
        result.triangle_uvs = o3d.utility.Vector2dVector(uvs.reshape(-1, 2))
    if mesh.has_triangle_material_ids():
        ids = np.asarray(mesh.triangle_material_ids)[trimmed.face_from]
        result.triangle_material_ids = o3d.utility.IntVector(ids.astype(np.int32))
    if mesh.has_textures():
        # Copies: an Image of the list lives only as long as its mesh.
        result.textures = [o3d.geometry.Image(np.array(image)) for image in mesh.textures]
    result.compute_vertex_normals()
    return result
