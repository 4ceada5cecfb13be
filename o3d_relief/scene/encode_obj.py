"""Wavefront OBJ with its materials: every number exact, faces and vertices in their order."""

from __future__ import annotations

import re
import zlib
from io import BytesIO

import numpy as np
from numpy.typing import NDArray

from o3d_relief.scene.arrays import WHITE, MeshArrays
from o3d_relief.scene.encode_parts import to_picture, unique_rows

__all__ = ["encode_obj"]


def encode_obj(arrays: MeshArrays, name: str) -> dict[str, bytes]:
    """Write an OBJ.

    Vertex colours follow the vertex ("v x y z r g b"), in six digits. A material library and PNG
    textures are named after the file, so that two OBJ files in one folder do not collide.

    Parameters
    ----------
    arrays : MeshArrays
        At least one face.
    name : str
        Name of the file.

    Returns
    -------
    dict of str to bytes
        File names and contents, the OBJ itself last.

    Examples
    --------
    >>> files = encode_obj(MeshArrays(vertices=np.eye(3), faces=np.array([[0, 1, 2]])), "corner.obj")
    >>> files["corner.obj"].decode().splitlines()[-1]
    'f 1 2 3'
    """
    stem = _companion_stem(name)
    lines = [f"mtllib {stem}.mtl"] if arrays.textures else []
    points = arrays.vertices.tolist()
    if arrays.colors is None:
        lines += [f"v {x!r} {y!r} {z!r}" for x, y, z in points]
    else:
        rows = zip(points, arrays.colors.tolist(), strict=True)
        lines += [f"v {x!r} {y!r} {z!r} {r:.6g} {g:.6g} {b:.6g}" for (x, y, z), (r, g, b) in rows]
    vertex = (arrays.faces + 1).ravel().tolist()
    texture: list[int] | None = None
    if arrays.triangle_uvs is not None:
        uvs, index = unique_rows(arrays.triangle_uvs)
        lines += [f"vt {u!r} {v!r}" for u, v in uvs.tolist()]
        texture = (index + 1).tolist()
    if arrays.normals is not None:
        lines += [f"vn {x!r} {y!r} {z!r}" for x, y, z in arrays.normals.tolist()]
    corners = _corners(vertex, texture, with_normals=arrays.normals is not None)
    faces = [f"f {a} {b} {c}" for a, b, c in zip(*[iter(corners)] * 3, strict=True)]
    if arrays.material_ids is not None:
        changes = np.flatnonzero(np.diff(arrays.material_ids, prepend=-1))
        for i in changes.tolist():
            faces[i] = f"usemtl material_{arrays.material_ids[i]}\n{faces[i]}"
    files = _encode_materials(arrays.textures, stem) if arrays.textures else {}
    return files | {name: ("\n".join(lines + faces) + "\n").encode("utf-8", "surrogateescape")}


def _corners(vertex: list[int], texture: list[int] | None, *, with_normals: bool) -> list[str]:
    """Write the corners of all faces; the normal of a corner is that of its vertex."""
    if texture is None:
        return [f"{i}//{i}" for i in vertex] if with_normals else [str(i) for i in vertex]
    pairs = zip(vertex, texture, strict=True)
    return [f"{i}/{j}/{i}" for i, j in pairs] if with_normals else [f"{i}/{j}" for i, j in pairs]


def _companion_stem(name: str) -> str:
    """Return how the names of the materials and textures begin.

    Many readers end a name at its first space. One without is made unique by a checksum: "a b.obj" must not
    write over the materials of "a_b.obj".
    """
    stem = name[: -len(".obj")]
    if not re.search(r"\s", stem):
        return stem
    checksum = zlib.crc32(stem.encode("utf-8", "surrogateescape"))
    return re.sub(r"\s", "_", stem) + f"_{checksum:08x}"


def _encode_materials(textures: tuple[NDArray[np.uint8], ...], stem: str) -> dict[str, bytes]:
    """Write the pictures and, last, the material library that names them."""
    files = {}
    lines = []
    for i, texture in enumerate(textures):
        lines += [f"newmtl material_{i}", "Ka 1 1 1", "Kd 1 1 1", "Ks 0 0 0"]
        if not np.array_equal(texture, WHITE):
            files[f"{stem}_{i}.png"] = _encode_png(texture)
            lines.append(f"map_Kd {stem}_{i}.png")
    return files | {f"{stem}.mtl": ("\n".join(lines) + "\n").encode("utf-8", "surrogateescape")}


def _encode_png(texture: NDArray[np.uint8]) -> bytes:
    stream = BytesIO()
    to_picture(texture).save(stream, format="PNG")
    return stream.getvalue()
