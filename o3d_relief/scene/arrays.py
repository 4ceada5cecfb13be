"""A mesh as plain arrays: what the readers return, what the encoders take."""

from __future__ import annotations

from dataclasses import dataclass
from os import PathLike
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from o3d_relief.errors import MeshError

if TYPE_CHECKING:
    import open3d as o3d

__all__ = ["WHITE", "CloudArrays", "MeshArrays", "cloud_arrays", "from_open3d", "mended", "to_open3d"]

WHITE = np.full((1, 1, 3), 255, dtype=np.uint8)
"""The texture of a material that has none: colour = texture * vertex colour then holds everywhere."""


_LARGEST = 1e30
"""Colours and texture coordinates beyond this do not count as numbers; float32 ends at 3e38."""


@dataclass(frozen=True, kw_only=True)
class MeshArrays:
    """A triangle mesh as arrays.

    Parameters
    ----------
    vertices : (n, 3) float64
        In the file's unit.
    faces : (m, 3) int64
        Vertex indices, from 0.
    colors : (n, 3) float64, optional
        Vertex colours, from 0 to 1.
    normals : (n, 3) float64, optional
        Vertex normals.
    triangle_uvs : (3m, 2) float64, optional
        Texture coordinates of each corner, the origin at the texture's lower left.
    material_ids : (m,) int64, optional
        Index into `textures` for each face. None without textures.
    textures : tuple of (h, w, 3) uint8
        Row 0 is the bottom (v = 0), as Open3D's own OBJ reader keeps them.
    missing : tuple of str
        Files of materials and textures that the file names and that could not be read.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    colors: NDArray[np.float64] | None = None
    normals: NDArray[np.float64] | None = None
    triangle_uvs: NDArray[np.float64] | None = None
    material_ids: NDArray[np.int64] | None = None
    textures: tuple[NDArray[np.uint8], ...] = ()
    missing: tuple[str, ...] = ()


def to_open3d(arrays: MeshArrays) -> o3d.geometry.TriangleMesh:
    """Make an Open3D mesh of arrays whose indices are in range.

    Parameters
    ----------
    arrays : MeshArrays
        Copied.

    Returns
    -------
    open3d.geometry.TriangleMesh
        With the attributes that the arrays have.

    Examples
    --------
    >>> corner = MeshArrays(vertices=np.eye(3), faces=np.array([[0, 1, 2]]))
    >>> len(to_open3d(corner).triangles)
    1
    """
    import open3d as o3d

    mesh = o3d.geometry.TriangleMesh()
    mesh.vertices = o3d.utility.Vector3dVector(np.array(arrays.vertices))  # Open3D takes no read-only arrays
    mesh.triangles = o3d.utility.Vector3iVector(arrays.faces.astype(np.int32))
    if arrays.colors is not None:
        mesh.vertex_colors = o3d.utility.Vector3dVector(np.array(arrays.colors))
    if arrays.normals is not None:
        mesh.vertex_normals = o3d.utility.Vector3dVector(arrays.normals)
    if arrays.triangle_uvs is not None:
        mesh.triangle_uvs = o3d.utility.Vector2dVector(arrays.triangle_uvs)
    if arrays.textures and arrays.material_ids is not None:
        mesh.textures = [o3d.geometry.Image(np.ascontiguousarray(texture)) for texture in arrays.textures]
        mesh.triangle_material_ids = o3d.utility.IntVector(arrays.material_ids.astype(np.int32))
    return mesh


def mended(values: NDArray[np.float64], stand_in: float) -> tuple[NDArray[np.float64], int]:
    """Replace the rows of an attribute that are not finite, or too large to be meant.

    Parameters
    ----------
    values : (n, c) float64
    stand_in : float
        For colours 1, white; for texture coordinates 0.5, the middle of the texture.

    Returns
    -------
    values : (n, c) float64
    count : int
        Rows that were replaced.

    Examples
    --------
    >>> mended(np.array([[0.2, np.nan], [0.3, 0.4]]), 1.0)
    (array([[1. , 1. ],
           [0.3, 0.4]]), 1)
    """
    usable = np.asarray((np.abs(values) <= _LARGEST).all(axis=1))
    return np.where(usable[:, None], values, stand_in), int((~usable).sum())


def from_open3d(mesh: o3d.geometry.TriangleMesh) -> MeshArrays:
    """Copy an Open3D mesh into arrays.

    Attributes whose length does not fit the mesh are left out, and normals that are not all finite. Colours
    that are not finite become white, such texture coordinates the middle of the texture. Material ids
    without a texture, and textures without a pixel, become a white texture.

    Parameters
    ----------
    mesh : open3d.geometry.TriangleMesh
        Never modified.

    Returns
    -------
    MeshArrays
        Copies.

    Examples
    --------
    >>> import open3d as o3d
    >>> from_open3d(o3d.geometry.TriangleMesh.create_box()).faces.shape
    (12, 3)
    """
    vertices = np.array(mesh.vertices, dtype=np.float64).reshape(-1, 3)
    faces = np.array(mesh.triangles, dtype=np.int64).reshape(-1, 3)
    colors = np.array(mesh.vertex_colors, dtype=np.float64).reshape(-1, 3)
    normals = np.array(mesh.vertex_normals, dtype=np.float64).reshape(-1, 3)
    uvs = np.array(mesh.triangle_uvs, dtype=np.float64).reshape(-1, 2)
    ids = np.array(mesh.triangle_material_ids, dtype=np.int64).ravel()
    textures = [WHITE if texture.is_empty() else _to_rgb(np.array(texture)) for texture in mesh.textures]
    textured = len(faces) > 0 and len(uvs) == 3 * len(faces) and any(item is not WHITE for item in textures)
    if textured:
        ids = ids if len(ids) == len(faces) else np.zeros(len(faces), dtype=np.int64)
        missing = (ids < 0) | (ids >= len(textures))
        if missing.any():
            ids = np.where(missing, len(textures), ids)
            textures.append(WHITE)
    return MeshArrays(
        vertices=vertices,
        faces=faces,
        colors=mended(colors, 1.0)[0] if len(colors) == len(vertices) > 0 else None,
        normals=normals if len(normals) == len(vertices) > 0 and np.isfinite(normals).all() else None,
        triangle_uvs=mended(uvs, 0.5)[0] if len(uvs) == 3 * len(faces) > 0 else None,
        material_ids=ids if textured else None,
        textures=tuple(textures) if textured else (),
    )


def _to_rgb(pixels: NDArray[np.generic]) -> NDArray[np.uint8]:
    """Turn any Open3D picture, (h, w) or (h, w, 1 | 2 | 3 | 4), into 8 bit RGB; alpha is left out."""
    if pixels.dtype.kind == "f":
        pixels = np.rint(255.0 * np.clip(pixels, 0.0, 1.0))
    elif pixels.dtype == np.uint16:
        pixels = pixels // 257
    rgb = pixels.astype(np.uint8).reshape(*pixels.shape[:2], -1)
    return rgb[:, :, :3] if rgb.shape[2] >= 3 else np.repeat(rgb[:, :, :1], 3, axis=2)


@dataclass(frozen=True, kw_only=True)
class CloudArrays:
    """A point cloud as arrays.

    Parameters
    ----------
    points : (n, 3) float64
        In the file's unit; may be not finite.
    colors : (n, 3) float64, optional
        From 0 to 1.
    normals : (n, 3) float64, optional
        As they come.
    sensor : three floats, optional
        Where the scanner stood, if the file tells.
    """

    points: NDArray[np.float64]
    colors: NDArray[np.float64] | None = None
    normals: NDArray[np.float64] | None = None
    sensor: tuple[float, float, float] | None = None

    def to_open3d(self) -> o3d.geometry.PointCloud:
        """Return an Open3D point cloud, with copies."""
        import open3d as o3d

        cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(self.points))
        if self.colors is not None:
            cloud.colors = o3d.utility.Vector3dVector(self.colors)
        if self.normals is not None:
            cloud.normals = o3d.utility.Vector3dVector(self.normals)
        return cloud


def cloud_arrays(cloud: o3d.geometry.PointCloud) -> CloudArrays:
    """Copy an Open3D point cloud into arrays.

    Colours and normals whose number does not fit are left out.

    Parameters
    ----------
    cloud : open3d.geometry.PointCloud
        Never modified.

    Returns
    -------
    CloudArrays
        Copies.

    Raises
    ------
    MeshError
        Not a PointCloud, or an empty one.
    """
    import open3d as o3d

    if not isinstance(cloud, o3d.geometry.PointCloud):
        kind = f"{type(cloud).__module__}.{type(cloud).__qualname__}"
        advice = ""
        if isinstance(cloud, str | PathLike):
            advice = ": read the file with read_points"
        elif isinstance(cloud, o3d.t.geometry.PointCloud):
            advice = ": take what its to_legacy() returns"
        elif isinstance(cloud, o3d.geometry.TriangleMesh):
            advice = ": it is a mesh already"
        raise MeshError(f"The scan must be an open3d.geometry.PointCloud. Got a {kind} instead{advice}.")
    points, colors, normals = (
        np.array(item, dtype=np.float64).reshape(-1, 3)
        for item in (cloud.points, cloud.colors, cloud.normals)
    )
    if len(points) == 0:
        raise MeshError("The point cloud is empty: it has no points.")
    return CloudArrays(
        points=points,
        colors=colors if len(colors) == len(points) else None,
        normals=normals if len(normals) == len(points) else None,
    )
