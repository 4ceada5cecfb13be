"""PLY: polygons of any size, triangle strips, colours, normals, texture coordinates.

Strict on purpose: a file that ends too early is an error, and the vertices keep their numbers.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from o3d_relief.errors import FileError
from o3d_relief.scene.arrays import MeshArrays
from o3d_relief.scene.ply_tables import Columns, read_tables
from o3d_relief.scene.polygons import fan, strips

__all__ = ["decode_ply"]

_UV_NAMES = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"))


def decode_ply(data: bytes, read_texture: Callable[[str], NDArray[np.uint8] | None]) -> MeshArrays:
    r"""Read a PLY file.

    Read are positions, normals, colours, texture coordinates of vertices or corners, the textures that
    a comment names ("comment TextureFile a.png"), polygons (as fans) and triangle strips.

    Parameters
    ----------
    data : bytes
        The file.
    read_texture : callable
        Gives the texture of a file name, or None.

    Returns
    -------
    MeshArrays
        Vertices in the order of the file. No faces for a point cloud. Indices are not checked.

    Raises
    ------
    FileError
        Not a PLY file, or a damaged one: the reason, without the file's name.

    Examples
    --------
    >>> text = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
    >>> decode_ply((text + "property float z\nend_header\n1 2 3\n").encode(), lambda name: None).vertices
    array([[1., 2., 3.]])
    """
    tables, names = read_tables(data)
    vertex = tables.get("vertex", {})
    if not all(axis in vertex for axis in "xyz"):
        raise FileError("it has no vertices with x, y and z")
    faces, uvs, ids = _read_faces(tables, vertex)
    found = {name: read_texture(name) for name in names}
    textures = tuple(texture for name in names if (texture := found[name]) is not None)
    textured = len(textures) == len(names) > 0 and uvs is not None and ids.max(initial=0) < len(textures)
    return MeshArrays(
        vertices=_stack(vertex, ("x", "y", "z")),
        faces=faces,
        colors=_read_colors(vertex),
        normals=_stack(vertex, ("nx", "ny", "nz")) if all(n in vertex for n in ("nx", "ny", "nz")) else None,
        triangle_uvs=uvs,
        material_ids=ids if textured else None,
        textures=textures if textured else (),
        missing=tuple(name for name in found if found[name] is None) if uvs is not None else (),
    )


def _stack(columns: Columns, names: tuple[str, ...]) -> NDArray[np.float64]:
    with np.errstate(invalid="ignore"):  # a signalling NaN
        return np.stack([columns[name].astype(np.float64) for name in names], axis=1)


def _whole(column: NDArray[np.generic]) -> NDArray[np.int64]:
    """Return indices; some files store them as floats."""
    if column.dtype.kind == "f" and not (np.abs(column.astype(np.float64)) < 2.0**53).all():
        raise FileError("it has an index that is not a number")
    return column.astype(np.int64)


def _read_faces(
    tables: dict[str, Columns], vertex: Columns
) -> tuple[NDArray[np.int64], NDArray[np.float64] | None, NDArray[np.int64]]:
    """Return the triangles (m, 3), their texture coordinates (3m, 2) or None, their texture numbers (m,)."""
    none = np.zeros((0, 3), dtype=np.int64)
    face = tables.get("face", {})
    name = next((name for name in ("vertex_indices", "vertex_index") if f"{name}#" in face), "")
    if not name:
        strip = tables.get("tristrips", {}).get("vertex_indices")
        faces = none if strip is None else strips(_whole(strip))
        return faces, _read_vertex_uvs(vertex, faces), np.zeros(len(faces), dtype=np.int64)
    counts = face[f"{name}#"].astype(np.int64)
    corners = fan(counts)
    faces = _whole(face[name])[corners] if len(corners) else none
    numbers = _whole(face["texnumber"]) if "texnumber" in face else np.zeros(len(counts), dtype=np.int64)
    ids = np.repeat(numbers, np.maximum(counts - 2, 0))
    if "texcoord#" in face and np.array_equal(face["texcoord#"].astype(np.int64), 2 * counts):
        return faces, face["texcoord"].astype(np.float64).reshape(-1, 2)[corners].reshape(-1, 2), ids
    return faces, _read_vertex_uvs(vertex, faces), ids


def _read_vertex_uvs(vertex: Columns, faces: NDArray[np.int64]) -> NDArray[np.float64] | None:
    names = next((names for names in _UV_NAMES if all(name in vertex for name in names)), None)
    if names is None or len(faces) == 0 or faces.min() < 0 or faces.max() >= len(vertex["x"]):
        return None
    return _stack(vertex, names)[faces].reshape(-1, 2)


def _read_colors(vertex: Columns) -> NDArray[np.float64] | None:
    """Return colours from 0 to 1: whole numbers are shares of the largest of their type."""
    names = ("red", "green", "blue")
    if not all(name in vertex for name in names):
        return None
    kind: np.dtype[Any] = vertex["red"].dtype
    largest = 1.0 if kind.kind == "f" else float(np.iinfo(kind).max)
    return np.asarray(_stack(vertex, names) / largest)
