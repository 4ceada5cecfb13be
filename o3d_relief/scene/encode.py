"""Meshes to bytes: PLY, OBJ, STL and GLB. The same mesh gives the same bytes."""

from __future__ import annotations

from pathlib import PurePath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from o3d_relief.scene.arrays import MeshArrays
from o3d_relief.scene.encode_glb import encode_glb
from o3d_relief.scene.encode_obj import encode_obj
from o3d_relief.scene.encode_parts import color_bytes

__all__ = ["encode_mesh"]


def encode_mesh(arrays: MeshArrays, name: str) -> dict[str, bytes]:
    """Write a mesh in the format that its name ends in.

    Parameters
    ----------
    arrays : MeshArrays
        At least one face.
    name : str
        Name of the file: .ply, .stl, .glb or .obj.

    Returns
    -------
    dict of str to bytes
        File names and contents, the file itself last: an OBJ has materials and textures beside it.

    Examples
    --------
    >>> files = encode_mesh(MeshArrays(vertices=np.eye(3), faces=np.array([[0, 1, 2]])), "corner.stl")
    >>> len(files["corner.stl"])
    134
    """
    match PurePath(name).suffix.lower():
        case ".obj":
            return encode_obj(arrays, name)
        case ".ply":
            return {name: _encode_ply(arrays)}
        case ".stl":
            return {name: _encode_stl(arrays)}
        case _:
            return {name: encode_glb(arrays)}


def _encode_ply(arrays: MeshArrays) -> bytes:
    """Write a binary PLY: vertices and normals in float64, colours in 8 bits; no textures."""
    columns: list[tuple[str, str, NDArray[Any]]] = [
        (name, "double", arrays.vertices[:, i]) for i, name in enumerate("xyz")
    ]
    if arrays.normals is not None:
        columns += [(name, "double", arrays.normals[:, i]) for i, name in enumerate(("nx", "ny", "nz"))]
    if arrays.colors is not None:
        bytes_of_color = color_bytes(arrays.colors)
        columns += [(name, "uchar", bytes_of_color[:, i]) for i, name in enumerate(("red", "green", "blue"))]
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(arrays.vertices)}"]
    header += [f"property {kind} {name}" for name, kind, _ in columns]
    header += [f"element face {len(arrays.faces)}", "property list uchar int vertex_indices", "end_header\n"]
    dtypes = {"double": "<f8", "uchar": "u1"}
    rows = np.zeros(len(arrays.vertices), dtype=[(name, dtypes[kind]) for name, kind, _ in columns])
    for name, _, values in columns:
        rows[name] = values
    faces = np.zeros(len(arrays.faces), dtype=[("count", "u1"), ("index", "<i4", (3,))])
    faces["count"] = 3
    faces["index"] = arrays.faces
    return "\n".join(header).encode("ascii") + rows.tobytes() + faces.tobytes()


def _encode_stl(arrays: MeshArrays) -> bytes:
    """Write a binary STL: triangles in float32 with their normals, nothing else."""
    corners = arrays.vertices[arrays.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    blocks = np.zeros(
        len(arrays.faces), dtype=[("normal", "<f4", (3,)), ("corners", "<f4", (3, 3)), ("attribute", "<u2")]
    )
    blocks["normal"] = normals / np.where(lengths > 0.0, lengths, 1.0)
    blocks["corners"] = corners
    return bytes(80) + np.array([len(arrays.faces)], dtype="<u4").tobytes() + blocks.tobytes()
