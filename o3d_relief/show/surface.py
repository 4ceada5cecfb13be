"""What the pictures need to know of a mesh: clean triangles, crisp normals, colours, textures."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from o3d_relief.errors import MeshError
from o3d_relief.scene.arrays import mended
from o3d_relief.scene.convert import check_mesh
from o3d_relief.show.colors import to_linear
from o3d_relief.show.normals import crease_normals, number_places

if TYPE_CHECKING:
    import open3d as o3d

__all__ = ["Surface", "read_surface"]

_BOX_CORNERS = (np.arange(8)[:, None] >> np.arange(3)) & 1
_BOX_FACES = np.array(
    [
        *([0, 2, 3], [0, 3, 1], [4, 5, 7], [4, 7, 6]),  # z-, z+
        *([0, 1, 5], [0, 5, 4], [2, 6, 7], [2, 7, 3]),  # y-, y+
        *([0, 4, 6], [0, 6, 2], [1, 3, 7], [1, 7, 5]),  # x-, x+
    ]
)


@dataclass(frozen=True, kw_only=True, eq=False)
class Surface:
    """The triangles of a picture. n vertices, m faces with an area.

    Attributes
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int64
    normals : (m, 3) float32
        Unit normal of each face.
    corner_normals : (m, 3, 3) float32
        Unit normal at each corner of each face.
    doubled : (m,) bool
        Faces that lie on another face, as in meshes whose every face is there once for each side.
    vertex_colors : (n, 3) float32 or None
        Linear light.
    corner_uvs : (m, 3, 2) float32 or None
    texture_index : (m,) int64 or None
        Texture of each face, -1 for none.
    textures : tuple of (height, width, 3) float32
        Linear light; the first row lies at v = 0, as in Open3D.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    normals: NDArray[np.float32]
    corner_normals: NDArray[np.float32]
    doubled: NDArray[np.bool_]
    vertex_colors: NDArray[np.float32] | None
    corner_uvs: NDArray[np.float32] | None
    texture_index: NDArray[np.int64] | None
    textures: tuple[NDArray[np.float32], ...]

    def bounds(self) -> NDArray[np.float64]:
        """Return the least and the greatest corner (2, 3) of the faces."""
        used = self.vertices[self.faces].reshape(-1, 3)
        return np.array([used.min(axis=0), used.max(axis=0)])

    def joined_with_box(self, box: NDArray[np.float64]) -> Surface:
        """Return the surface with the 12 faces of a box (least and greatest corner) behind its own.

        Colours and textures are those of the surface alone: the new faces have none.
        """
        corners = box[_BOX_CORNERS, np.arange(3)]
        edges = corners[_BOX_FACES[:, 1:]] - corners[_BOX_FACES[:, :1]]
        cross = np.cross(edges[:, 0], edges[:, 1])
        normals = (cross / np.linalg.norm(cross, axis=1, keepdims=True)).astype(np.float32)
        return replace(
            self,
            vertices=np.vstack([self.vertices, corners]),
            faces=np.vstack([self.faces, _BOX_FACES + len(self.vertices)]),
            normals=np.vstack([self.normals, normals]),
            corner_normals=np.concatenate([self.corner_normals, np.repeat(normals[:, None], 3, axis=1)]),
            doubled=np.append(self.doubled, np.zeros(len(normals), dtype=bool)),
        )


def read_surface(mesh: o3d.geometry.TriangleMesh, crease_degrees: float) -> Surface:
    """Copy a mesh without its degenerate faces; one that is inside out gets its normals turned.

    Vertices that no face uses are moved to one that is used: they may be anything, also not finite.

    Raises
    ------
    MeshError
        No TriangleMesh, no triangle with an area, a face with a vertex that is not finite or an index out of
        range.
    """
    check_mesh("The mesh to draw", mesh)
    vertices = np.array(mesh.vertices, dtype=np.float64)
    faces = np.array(mesh.triangles, dtype=np.int64)
    if len(faces) == 0:
        raise MeshError("The mesh has no triangles to draw.")
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise MeshError("The mesh has a face index out of range.")
    used = np.zeros(len(vertices), dtype=bool)
    used[faces] = True
    if not np.all(np.isfinite(vertices[used])):
        raise MeshError("The mesh has vertices that are not finite.")
    vertices[~used] = vertices[faces[0, 0]]  # wherever they are
    corners = vertices[faces]
    extent = max(float(np.ptp(corners.reshape(-1, 3), axis=0).max()), 1e-300)
    edges = (corners[:, 1:] - corners[:, :1]) / extent
    cross = np.cross(edges[:, 0], edges[:, 1])
    area = np.linalg.norm(cross, axis=1)
    keep = area > 1e-14
    if not np.any(keep):
        raise MeshError("The mesh has no triangle with an area.")
    normals = (cross[keep] / area[keep, None]).astype(np.float32)
    if _inside_out(corners[keep] / extent):
        normals = -normals
    uvs, texture_index, textures = _read_textures(mesh, keep)
    colors = to_linear(mended(np.asarray(mesh.vertex_colors), 1.0)[0]) if mesh.has_vertex_colors() else None
    return Surface(
        vertices=vertices,
        faces=faces[keep],
        normals=normals,
        corner_normals=crease_normals(vertices / extent, faces[keep], normals, crease_degrees),
        doubled=_doubled(number_places(vertices)[faces[keep]]),
        vertex_colors=colors,
        corner_uvs=uvs,
        texture_index=texture_index,
        textures=textures,
    )


def _inside_out(corners: NDArray[np.float64]) -> bool:
    """Tell whether faces (m, 3, 3) enclose a clearly negative volume.

    Only of meshes that are closed but for small holes, whose area vectors nearly cancel: a niche that is
    open towards the camera is not inside out.
    """
    points = corners.reshape(-1, 3)
    local = corners - points.mean(axis=0)
    vectors = np.cross(local[:, 1] - local[:, 0], local[:, 2] - local[:, 0])
    if np.linalg.norm(vectors.sum(axis=0)) > 0.03 * np.linalg.norm(vectors, axis=1).sum():
        return False
    volume = np.einsum("ij,ij->", local[:, 0], np.cross(local[:, 1], local[:, 2])) / 6.0
    return bool(volume < -0.01 * np.prod(np.ptp(points, axis=0)))


def _doubled(corners: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Tell which faces (m, 3) have the same corners as another."""
    ordered = np.sort(corners, axis=1)
    order = np.lexsort(ordered.T)
    equal = np.all(ordered[order[1:]] == ordered[order[:-1]], axis=1)
    result = np.zeros(len(corners), dtype=bool)
    result[order[1:][equal]] = True
    result[order[:-1][equal]] = True
    return result


def _read_textures(
    mesh: o3d.geometry.TriangleMesh, keep: NDArray[np.bool_]
) -> tuple[NDArray[np.float32] | None, NDArray[np.int64] | None, tuple[NDArray[np.float32], ...]]:
    textures = tuple(_texture(image) for image in mesh.textures)
    usable = np.array([not image.is_empty() for image in mesh.textures], dtype=bool)
    if not mesh.has_triangle_uvs() or not np.any(usable):
        return None, None, ()
    uvs = mended(np.asarray(mesh.triangle_uvs), 0.5)[0].astype(np.float32).reshape(-1, 3, 2)[keep]
    chosen = np.array(mesh.triangle_material_ids, dtype=np.int64)
    chosen = chosen[keep] if len(chosen) == len(keep) else np.zeros(len(uvs), dtype=np.int64)
    inside = (chosen >= 0) & (chosen < len(textures))
    chosen = np.where(inside & usable[np.clip(chosen, 0, len(textures) - 1)], chosen, -1)
    return uvs, chosen, textures


def _texture(image: o3d.geometry.Image) -> NDArray[np.float32]:
    if image.is_empty():
        return np.ones((1, 1, 3), dtype=np.float32)
    values = np.asarray(image)
    values = values.reshape(*values.shape[:2], -1)
    values = values[..., :3] if values.shape[2] >= 3 else np.repeat(values[..., :1], 3, axis=2)
    if np.issubdtype(values.dtype, np.integer):
        return to_linear(values.astype(np.float32) / np.iinfo(values.dtype).max)
    return to_linear(values)
