"""Meshes to bytes: PLY, OBJ, STL and GLB. The same mesh gives the same bytes."""

from __future__ import annotations

from io import BytesIO
from typing import Any

import numpy as np
from numpy.typing import NDArray

from o3d_relief.scene.arrays import WHITE, MeshArrays

__all__ = ["encode_glb", "encode_obj", "encode_ply", "encode_stl"]


def encode_ply(arrays: MeshArrays) -> bytes:
    """Write a binary PLY: vertices and normals in float64, colours in 8 bits; no textures.

    Parameters
    ----------
    arrays : MeshArrays
        At least one face.

    Returns
    -------
    bytes
        The file.

    Examples
    --------
    >>> encode_ply(MeshArrays(vertices=np.eye(3), faces=np.array([[0, 1, 2]])))[:3]
    b'ply'
    """
    columns: list[tuple[str, str, NDArray[Any]]] = [
        (name, "double", arrays.vertices[:, i]) for i, name in enumerate("xyz")
    ]
    if arrays.normals is not None:
        columns += [(name, "double", arrays.normals[:, i]) for i, name in enumerate(("nx", "ny", "nz"))]
    if arrays.colors is not None:
        bytes_of_color = _to_bytes(arrays.colors)
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


def encode_stl(arrays: MeshArrays) -> bytes:
    """Write a binary STL: triangles in float32 with their normals, nothing else.

    Parameters
    ----------
    arrays : MeshArrays
        At least one face.

    Returns
    -------
    bytes
        The file.

    Examples
    --------
    >>> len(encode_stl(MeshArrays(vertices=np.eye(3), faces=np.array([[0, 1, 2]]))))
    134
    """
    corners = arrays.vertices[arrays.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    blocks = np.zeros(
        len(arrays.faces), dtype=[("normal", "<f4", (3,)), ("corners", "<f4", (3, 3)), ("attribute", "<u2")]
    )
    blocks["normal"] = normals / np.where(lengths > 0.0, lengths, 1.0)
    blocks["corners"] = corners
    return bytes(80) + np.array([len(arrays.faces)], dtype="<u4").tobytes() + blocks.tobytes()


def encode_obj(arrays: MeshArrays, stem: str) -> dict[str, bytes]:
    """Write an OBJ with its materials: every number exact, faces and vertices in their order.

    Vertex colours follow the vertex ("v x y z r g b"), in six digits. A material library and PNG
    textures are named after the file, so that two OBJ files in one folder do not collide.

    Parameters
    ----------
    arrays : MeshArrays
        At least one face.
    stem : str
        Name of the file without its ending.

    Returns
    -------
    dict of str to bytes
        File names and contents, the OBJ itself last.

    Examples
    --------
    >>> files = encode_obj(MeshArrays(vertices=np.eye(3), faces=np.array([[0, 1, 2]])), "corner")
    >>> files["corner.obj"].decode().splitlines()[-1]
    'f 1 2 3'
    """
    lines = [f"mtllib {stem}.mtl"] if arrays.textures else []
    points = arrays.vertices.tolist()
    if arrays.colors is None:
        lines += [f"v {x!r} {y!r} {z!r}" for x, y, z in points]
    else:
        rows = zip(points, arrays.colors.tolist(), strict=True)
        lines += [f"v {x!r} {y!r} {z!r} {r:.6g} {g:.6g} {b:.6g}" for (x, y, z), (r, g, b) in rows]
    vertex = (arrays.faces + 1).tolist()
    corners = [list(map(str, row)) for row in vertex]
    if arrays.triangle_uvs is not None:
        uvs, index = _unique_rows(arrays.triangle_uvs)
        lines += [f"vt {u!r} {v!r}" for u, v in uvs.tolist()]
        texture = (index.reshape(-1, 3) + 1).tolist()
        corners = [
            [f"{i}/{j}" for i, j in zip(*rows, strict=True)] for rows in zip(vertex, texture, strict=True)
        ]
    if arrays.normals is not None:
        lines += [f"vn {x!r} {y!r} {z!r}" for x, y, z in arrays.normals.tolist()]
        slash = "/" if arrays.triangle_uvs is not None else "//"
        corners = [
            [f"{corner}{slash}{i}" for corner, i in zip(*rows, strict=True)]
            for rows in zip(corners, vertex, strict=True)
        ]
    faces = [f"f {a} {b} {c}" for a, b, c in corners]
    if arrays.material_ids is not None:
        changes = np.flatnonzero(np.diff(arrays.material_ids, prepend=-1))
        for i in changes.tolist():
            faces[i] = f"usemtl material_{arrays.material_ids[i]}\n{faces[i]}"
    files = _encode_materials(arrays.textures, stem) if arrays.textures else {}
    return files | {f"{stem}.obj": ("\n".join(lines + faces) + "\n").encode("utf-8", "surrogateescape")}


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


def encode_glb(arrays: MeshArrays) -> bytes:
    """Write a GLB: one mesh for each material, float32, vertex colours in 8 bits.

    The format stores texture coordinates with the vertex: where the corners of a vertex differ, the
    vertex is written once for each. Without textures the vertices keep their numbers. Faces are sorted by
    material.

    Parameters
    ----------
    arrays : MeshArrays
        At least one face.

    Returns
    -------
    bytes
        The file.

    Examples
    --------
    >>> encode_glb(MeshArrays(vertices=np.eye(3), faces=np.array([[0, 1, 2]])))[:4]
    b'glTF'
    """
    import trimesh
    from trimesh.exchange.gltf import export_glb
    from trimesh.visual import TextureVisuals
    from trimesh.visual.material import PBRMaterial

    scene = trimesh.Scene()
    used = [0] if arrays.material_ids is None else np.unique(arrays.material_ids).tolist()
    for material in used:
        chosen = slice(None) if arrays.material_ids is None else arrays.material_ids == material
        vertex, faces, uvs = _split_corners(arrays, chosen, keep_all=len(used) == 1)
        image = None
        if arrays.textures and not np.array_equal(arrays.textures[material], WHITE):
            image = _to_picture(arrays.textures[material])
        visual = TextureVisuals(
            uv=uvs,
            material=PBRMaterial(
                name=f"material_{material}", baseColorTexture=image, metallicFactor=0.0, roughnessFactor=1.0
            ),
        )
        if arrays.colors is not None:
            opaque = np.full((len(vertex), 1), 255, dtype=np.uint8)
            visual.vertex_attributes["color"] = np.hstack([_to_bytes(arrays.colors[vertex]), opaque])
        scene.add_geometry(
            trimesh.Trimesh(
                vertices=arrays.vertices[vertex],
                faces=faces,
                vertex_normals=None if arrays.normals is None else arrays.normals[vertex],
                visual=visual,
                process=False,
            ),
            geom_name=f"mesh_{material}",
            node_name=f"node_{material}",
        )
    encoded: bytes = export_glb(scene, include_normals=arrays.normals is not None)
    return encoded


def _split_corners(
    arrays: MeshArrays, chosen: slice | NDArray[np.bool_], *, keep_all: bool
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64] | None]:
    """Give every pair of vertex and texture coordinate that the chosen faces use a vertex of its own.

    Returns the old index of each new vertex (p,), the new faces (q, 3) and the coordinates (p, 2).
    """
    faces = arrays.faces[chosen]
    if arrays.triangle_uvs is None:
        return np.arange(len(arrays.vertices)), faces, None
    uvs, uv_index = _unique_rows(arrays.triangle_uvs.reshape(-1, 3, 2)[chosen].reshape(-1, 2))
    keys = faces.ravel() * len(uvs) + uv_index
    unused = np.setdiff1d(np.arange(len(arrays.vertices)), faces) if keep_all else np.zeros(0, dtype=np.int64)
    pairs, corner = np.unique(np.concatenate([keys, unused * len(uvs)]), return_inverse=True)
    return pairs // len(uvs), corner[: len(keys)].reshape(-1, 3), uvs[pairs % len(uvs)]


def _unique_rows(pairs: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return the different rows of pairs (p, 2) and, for each row, which of them it is (p,)."""
    values, index = np.unique(np.ascontiguousarray(pairs).view(np.complex128).ravel(), return_inverse=True)
    return values.view(np.float64).reshape(-1, 2), index.ravel()


def _to_bytes(colors: NDArray[np.float64]) -> NDArray[np.uint8]:
    return np.rint(255.0 * np.clip(colors, 0.0, 1.0)).astype(np.uint8)


def _to_picture(texture: NDArray[np.uint8]) -> Any:
    """Make a picture of a texture, the top row first."""
    from PIL import Image

    return Image.fromarray(np.ascontiguousarray(texture[::-1]))


def _encode_png(texture: NDArray[np.uint8]) -> bytes:
    stream = BytesIO()
    _to_picture(texture).save(stream, format="PNG")
    return stream.getvalue()
