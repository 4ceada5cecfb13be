"""Wavefront OBJ with its materials: polygons of any size, vertices and faces in the order of the file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from o3d_relief.errors import FileError
from o3d_relief.scene.arrays import MeshArrays
from o3d_relief.scene.mtl import Material, decode_mtl, dress_faces
from o3d_relief.scene.polygons import fan
from o3d_relief.scene.text import decode_text, to_table

__all__ = ["decode_obj"]


@dataclass
class _Lines:
    """The lines of an OBJ file by their kind, without their key."""

    v: list[str] = field(default_factory=list)
    vt: list[str] = field(default_factory=list)
    vn: list[str] = field(default_factory=list)
    f: list[str] = field(default_factory=list)
    relative: dict[int, tuple[int, int, int]] = field(default_factory=dict)  # v, vt, vn before such a face
    material: list[str] = field(default_factory=list)  # of each face
    libraries: list[str] = field(default_factory=list)


def decode_obj(
    data: bytes,
    read_file: Callable[[str], bytes | None],
    read_texture: Callable[[str], NDArray[np.uint8] | None],
) -> MeshArrays:
    r"""Read an OBJ file.

    Material libraries and textures that are missing are left out. A texture rules over the colour of its
    material. Where no material has a texture and all have one colour, it becomes the vertex colour;
    otherwise a material without a texture gets one pixel of its colour, white if it has none. Normals
    of the corners of a vertex are averaged.

    Parameters
    ----------
    data : bytes
        The file.
    read_file : callable
        Gives the content of another file by its name (a material library), or None.
    read_texture : callable
        Gives the texture of a file name, or None.

    Returns
    -------
    MeshArrays
        Vertices and faces in the order of the file; polygons are cut into fans. No faces for a point
        cloud.

    Raises
    ------
    FileError
        A damaged file: the reason, without the file's name.

    Examples
    --------
    >>> quad = b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n"
    >>> decode_obj(quad, lambda name: None, lambda name: None).faces.tolist()
    [[0, 1, 2], [0, 2, 3]]
    """
    lines = _sort_lines(decode_text(data))
    table = to_table(lines.v, 3)
    counts = np.array([len(line.split()) for line in lines.f], dtype=np.int64)
    if (counts < 3).any():
        raise FileError("it has a face with fewer than three corners")
    corners = _read_corners(lines, counts)
    triangles = fan(counts)
    uvs = None
    if lines.vt and (corners[:, 1] >= 0).any():
        rows = np.vstack([to_table(lines.vt, 2)[:, :2], [[0.5, 0.5]]])  # -1: no texture coordinate
        uvs = rows[corners[:, 1][triangles]].reshape(-1, 2)
    materials, missing = _read_materials(lines.libraries, read_file)
    dress = dress_faces(lines.material, materials, uvs is not None, read_texture)
    colors = _read_colors(table)
    if colors is None and dress.color is not None:
        colors = np.tile(np.clip(dress.color, 0.0, 1.0), (len(table), 1))
    if dress.textures and uvs is None:
        uvs = np.full((3 * len(triangles), 2), 0.5)
    return MeshArrays(
        vertices=table[:, :3],
        faces=corners[:, 0][triangles],
        colors=colors,
        normals=_read_normals(lines.vn, corners, len(table)),
        triangle_uvs=uvs,
        material_ids=None if dress.ids is None else np.repeat(dress.ids, counts - 2),
        textures=dress.textures,
        missing=missing + dress.missing,
    )


def _sort_lines(text: str) -> _Lines:
    lines = _Lines()
    material = ""
    for line in text.splitlines():
        key, rest = [*line.split(None, 1), "", ""][:2]
        if key == "usemtl":
            material = rest.strip()
        elif key == "mtllib":
            lines.libraries.append(rest.strip())
        elif key in ("v", "vt", "vn", "f"):
            content = rest.split("#", 1)[0] if "#" in rest else rest
            if key == "f":
                if "-" in content:
                    lines.relative[len(lines.f)] = (len(lines.v), len(lines.vt), len(lines.vn))
                lines.material.append(material)
            getattr(lines, key).append(content)
    return lines


def _read_materials(
    libraries: list[str], read_file: Callable[[str], bytes | None]
) -> tuple[dict[str, Material], tuple[str, ...]]:
    """Return the materials by name, and the libraries that are missing."""
    materials: dict[str, Material] = {}
    missing: list[str] = []
    for line in filter(None, dict.fromkeys(libraries)):
        # One name with spaces in it, or several names.
        content = read_file(line)
        names = [line] if content is not None or line.count(".") < 2 else line.split()
        for name in names:
            content = read_file(name)
            materials |= decode_mtl(content or b"")
            missing += [name] if content is None else []
    return materials, tuple(missing)


def _read_corners(lines: _Lines, counts: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the indices of v, vt and vn of each corner (p, 3), from 0; -1 for none."""
    # The strict and simple way; about a second for 400,000 faces with three indices a corner.
    parts = [token.split("/") for line in lines.f for token in line.split()]
    try:
        columns = [[int(part[i]) if len(part) > i and part[i] else 0 for part in parts] for i in range(3)]
        corners = np.array(columns, dtype=np.int64).reshape(3, -1).T - 1
    except (ValueError, OverflowError):
        raise FileError("it has a face whose corners are not numbers") from None
    if lines.relative:
        before = np.zeros((len(lines.f), 3), dtype=np.int64)
        before[list(lines.relative)] = list(lines.relative.values())
        corners = np.where(corners < -1, np.repeat(before, counts, axis=0) + corners + 1, corners)
    totals = np.array([len(lines.v), len(lines.vt), len(lines.vn)])
    valid = (corners >= 0) & (corners < totals)
    if not valid[:, 0].all():
        raise FileError("it has a face with a vertex that does not exist")
    return np.where(valid, corners, -1)


def _read_colors(table: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Return the colours that follow the vertices (n, 3), from 0 to 1; some programs write 0 to 255."""
    if table.shape[1] < 6:
        return None
    colors = table[:, 3:6]
    return colors / 255.0 if colors.max(initial=0.0) > 1.0 else colors


def _read_normals(lines: list[str], corners: NDArray[np.int64], n: int) -> NDArray[np.float64] | None:
    """Return the normal of each vertex (n, 3): the mean direction of those of its corners."""
    if not lines or len(corners) == 0 or (corners[:, 2] < 0).any():
        return None
    normals = to_table(lines, 3)[:, :3]
    vertex, index = corners[:, 0], corners[:, 2]
    if len(normals) == n and np.array_equal(vertex, index):
        return normals
    sums = np.stack([np.bincount(vertex, normals[index, axis], minlength=n) for axis in range(3)], axis=1)
    lengths = np.linalg.norm(sums, axis=1, keepdims=True)
    return sums / np.where(lengths > 0.0, lengths, 1.0)
