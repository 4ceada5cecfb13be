"""The relief's mesh, with the attributes of the input carried over."""

from __future__ import annotations

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from o3d_relief.scene.arrays import mended
from o3d_relief.scene.weld import same_places
from o3d_relief.stages.trim import Trimmed

__all__ = ["smooth_normals", "trimmed_mesh"]

_CREASE = 0.866
"""Cosine of 30 degrees: normals at one place that differ more from their mean stay apart."""

_BLOCK = 16384
"""Faces that are worked on at once."""


def trimmed_mesh(
    mesh: o3d.geometry.TriangleMesh, trimmed: Trimmed, unit: float
) -> tuple[o3d.geometry.TriangleMesh, int]:
    """Build the output mesh and carry the input's attributes over to it.

    Vertex colours and triangle UVs are interpolated along the cut, textures and material ids kept, and
    vertex normals computed anew. Attributes whose length does not fit the mesh are left out. Colours that
    are not finite become white, such texture coordinates the middle of the texture.

    Parameters
    ----------
    mesh : open3d.geometry.TriangleMesh
        The input, whose vertex and triangle numbers `trimmed` refers to.
    trimmed : Trimmed
    unit : float
        Length of one relief unit, in the unit of the mesh.

    Returns
    -------
    mesh : open3d.geometry.TriangleMesh
    mended : int
        Colours and texture coordinates of the input that were replaced.
    """
    result = o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector(trimmed.vertices),
        o3d.utility.Vector3iVector(trimmed.faces.astype(np.int32)),
    )
    faces = np.asarray(mesh.triangles, dtype=np.int64)
    bad_colors = bad_uvs = 0
    if mesh.has_vertex_colors():
        colors, bad_colors = mended(np.asarray(mesh.vertex_colors), 1.0)
        result.vertex_colors = o3d.utility.Vector3dVector(trimmed.to_vertices(colors))
    if mesh.has_triangle_uvs():
        uvs, bad_uvs = mended(np.asarray(mesh.triangle_uvs), 0.5)
        uvs = trimmed.to_corners(faces, uvs.reshape(-1, 3, 2))
        result.triangle_uvs = o3d.utility.Vector2dVector(uvs.reshape(-1, 2))
    if mesh.has_triangle_material_ids():
        ids = np.asarray(mesh.triangle_material_ids)[trimmed.face_from]
        result.triangle_material_ids = o3d.utility.IntVector(ids.astype(np.int32))
    # Copies: an Image of the list lives only as long as its mesh. Open3D's own reader leaves empty ones
    # for materials without a texture.
    result.textures = [
        o3d.geometry.Image() if image.is_empty() else o3d.geometry.Image(np.array(image))
        for image in mesh.textures
    ]
    normals = smooth_normals(trimmed.vertices / unit, trimmed.faces)
    result.vertex_normals = o3d.utility.Vector3dVector(normals)
    return result, bad_colors + bad_uvs


def smooth_normals(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.float64]:
    """Compute vertex normals that do not show the seams of a mesh.

    Area-weighted face normals, shared by all vertices at one place but for those that differ by more than
    30 degrees from their common mean: these lie at a crease.

    Parameters
    ----------
    vertices : (n, 3) float64
        In relief units.
    faces : (m, 3) int64

    Returns
    -------
    (n, 3) float64
        Of unit length; +z for a vertex whose faces have no area.
    """
    own = _area_normals(vertices, faces)
    first = same_places(vertices, faces)
    own_unit = _unit(own)
    if (first == np.arange(len(first))).all():
        return own_unit
    shared = np.stack([np.bincount(first, weights=along, minlength=len(vertices)) for along in own.T], axis=1)
    shared_unit = _unit(np.asarray(shared, dtype=np.float64))[first]
    alike = (own_unit * shared_unit).sum(axis=1) >= _CREASE
    return np.where(alike[:, None], shared_unit, own_unit)


def _area_normals(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.float64]:
    """Add up the normals of the faces around each vertex, as long as twice their areas."""
    places, corners = np.ascontiguousarray(vertices.T), np.ascontiguousarray(faces.T)
    own = np.zeros(places.shape)
    for begin in range(0, len(faces), _BLOCK):
        a, b, c = corners[:, begin : begin + _BLOCK]
        (ux, uy, uz), (vx, vy, vz) = (places[:, end] - places[:, a] for end in (b, c))
        normal = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        for total, along in zip(own, normal, strict=True):
            for corner in (a, b, c):
                np.add.at(total, corner, along)
    return np.ascontiguousarray(own.T)


def _unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    length = np.sqrt(np.einsum("nc,nc->n", vectors, vectors))
    flat = length == 0.0
    result = vectors / np.where(flat, 1.0, length)[:, None]
    result[flat] = [0.0, 0.0, 1.0]
    return np.asarray(result)
