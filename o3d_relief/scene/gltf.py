"""GLB and glTF, through trimesh: all nodes in their places, materials as textures and vertex colours."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from o3d_relief.errors import FileError
from o3d_relief.limits import memory_for
from o3d_relief.scene.arrays import WHITE, MeshArrays

__all__ = ["decode_gltf"]

# Required extensions that change nothing of what is read here.
_HARMLESS = ("KHR_materials_", "KHR_lights_", "KHR_texture_transform", "EXT_texture_webp", "KHR_xmp")
_FLOAT = 5126


@dataclass(frozen=True, kw_only=True)
class _Part:
    """A geometry in its place: the arrays of `MeshArrays`, and a PIL picture or None."""

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    colors: NDArray[np.float64] | None
    normals: NDArray[np.float64] | None
    triangle_uvs: NDArray[np.float64] | None
    image: Any


def decode_gltf(data: bytes, kind: str, resolver: Any, to_texture: Callable[[Any], Any]) -> MeshArrays:
    """Read a GLB or glTF file.

    The meshes follow each other in the order of the file, one copy for each node that shows them, in the
    frame of the scene; a mirrored copy is turned inside out again. Base colours, and the colours of
    vertices, become vertex colours, base textures become textures: colour = texture * vertex colour.

    Parameters
    ----------
    data : bytes
        The file.
    kind : {"glb", "gltf"}
        Binary or JSON.
    resolver
        Finds other files that the file names: by `get(name)`, `[name]`, or raises an OSError.
    to_texture : callable
        Turns a PIL picture into a texture.

    Returns
    -------
    MeshArrays
        No faces where the file has no triangles. Indices are not checked.

    Raises
    ------
    FileError
        A damaged file, or one that needs an extension which trimesh cannot read: the reason, without the
        file's name.

    Examples
    --------
    >>> decode_gltf(b"glTF", "glb", None, None)
    Traceback (most recent call last):
    o3d_relief.errors.FileError: it is not a GLB file, or a damaged one
    """
    import trimesh.exchange.load as loaders
    from trimesh.util import wrap_as_stream

    header = _read_header(data, kind)
    try:
        _check_header(header)
        loaded = loaders.mesh_loaders[kind](file_obj=wrap_as_stream(data), file_type=kind, resolver=resolver)
        placed = [(geometry, matrix) for geometry, matrix in _walk(loaded) if "faces" in geometry]
        triangles = sum(len(geometry["faces"]) for geometry, _ in placed)
        if not memory_for(triangles):  # a small file may show one mesh a million times
            raise FileError(f"its nodes show {triangles:,} triangles, more than there is memory for")
        parts = [_place(geometry, matrix) for geometry, matrix in placed]
    except FileError:
        raise
    # trimesh reads the JSON as it comes and checks little: a damaged file ends in a KeyError,
    # IndexError, ValueError, AssertionError, AttributeError, zlib.error, binascii.Error ..., by chance.
    except Exception as error:
        raise FileError("it is damaged, or a file that it names is missing") from error
    arrays = _join([part for part in parts if len(part.faces)], to_texture)
    return replace(arrays, missing=_missing_images(header, resolver))


def _missing_images(header: dict[str, Any], resolver: Any) -> tuple[str, ...]:
    """Return the names of the pictures that are not there."""
    missing = []
    for image in header.get("images", []):
        name = image.get("uri")
        if isinstance(name, str) and not name.startswith("data:"):
            try:
                resolver.get(name)
            except (OSError, ValueError):
                missing.append(name)
    return tuple(missing)


def _read_header(data: bytes, kind: str) -> dict[str, Any]:
    """Return the JSON part."""
    try:
        if kind == "glb":
            magic, _, length, size, chunk = struct.unpack_from("<4sIII4s", data)
            if magic != b"glTF" or chunk != b"JSON":
                raise FileError("it is not a GLB file, or a damaged one")
            if length > len(data):
                raise FileError("it ends too early, part of it is missing")
            header = json.loads(data[20 : 20 + size])
        else:
            header = json.loads(data)
    except (struct.error, ValueError, RecursionError):
        raise FileError(f"it is not a {'GLB' if kind == 'glb' else 'glTF'} file, or a damaged one") from None
    if not isinstance(header, dict):
        raise FileError("it is damaged")
    return header


def _check_header(header: dict[str, Any]) -> None:
    """Refuse what trimesh would read as zeros or noise without a word."""
    for name in header.get("extensionsRequired", ()):
        if not str(name).startswith(_HARMLESS):
            raise FileError(f"it needs the glTF extension {name}, save it without")
    accessors = header.get("accessors", [])
    if any("sparse" in accessor for accessor in accessors):
        raise FileError("it has sparse accessors, save it without")
    floats = [accessor.get("componentType") == _FLOAT for accessor in accessors]
    for mesh in header.get("meshes", []):
        for primitive in mesh.get("primitives", []):
            attributes = primitive.get("attributes", {})
            for index in (attributes.get("POSITION"), primitive.get("indices")):
                if isinstance(index, int) and "bufferView" not in accessors[index]:
                    raise FileError("it has geometry without data, save it without compression")
            index = attributes.get("TEXCOORD_0")
            if isinstance(index, int) and not all(floats[index : index + 1]):
                raise FileError("its texture coordinates are whole numbers, save them as floats")


def _walk(loaded: dict[str, Any]) -> list[tuple[dict[str, Any], NDArray[np.float64]]]:
    """Return each placed geometry with its transform (4, 4) to the scene, in the order of the meshes."""
    geometries = loaded["geometry"]
    order = {name: place for place, name in enumerate(geometries)}
    world = {loaded["base_frame"]: np.eye(4)}
    placed = []
    for edge in loaded["graph"]:  # parents come first
        world[edge["frame_to"]] = world[edge["frame_from"]] @ edge["matrix"]
        if edge.get("geometry") is not None:
            placed.append((edge["geometry"], world[edge["frame_to"]]))
    placed.sort(key=lambda item: order[item[0]])
    return [(geometries[name], matrix) for name, matrix in placed]


def _place(geometry: dict[str, Any], matrix: NDArray[np.float64]) -> _Part:
    """Move a geometry to its place; turn the faces of a mirrored one."""
    vertices = np.asarray(geometry["vertices"], dtype=np.float64)
    faces = np.asarray(geometry["faces"]).astype(np.int64).reshape(-1, 3)
    if vertices.ndim != 2 or vertices.shape[1] != 3:
        raise FileError("it is damaged")
    if len(faces) and (faces.min() < 0 or faces.max() >= len(vertices)):
        raise FileError("it has a face with a vertex that does not exist")
    linear = matrix[:3, :3]
    if np.linalg.det(linear) < 0.0:
        faces = faces[:, [0, 2, 1]]
    normals = geometry.get("vertex_normals")
    if normals is not None:
        normals = np.asarray(normals, dtype=np.float64) @ np.linalg.pinv(linear)
        lengths = np.linalg.norm(normals, axis=1, keepdims=True)
        normals = normals / np.where(lengths > 0.0, lengths, 1.0)
    n = len(vertices)
    colors, uvs, image = _read_material(geometry, n)
    if (colors is not None and colors.shape != (n, 3)) or (uvs is not None and uvs.shape != (n, 2)):
        raise FileError("it is damaged")
    return _Part(
        vertices=vertices @ linear.T + matrix[:3, 3],
        faces=faces,
        colors=colors,
        normals=normals if normals is not None and normals.shape == vertices.shape else None,
        triangle_uvs=None if uvs is None else uvs[faces].reshape(-1, 2),
        image=image,
    )


def _read_material(
    geometry: dict[str, Any], n: int
) -> tuple[NDArray[np.float64] | None, NDArray[np.float64] | None, Any]:
    """Return the vertex colours (n, 3), the texture coordinates (n, 2) and the picture, None for none."""
    visual = geometry.get("visual")
    colors = geometry.get("vertex_colors")
    if visual is None:
        return (None if colors is None else _to_unit(colors)), None, None
    colors = visual.vertex_attributes.get("color", colors)
    colors = None if colors is None else _to_unit(colors)
    factor = visual.material.baseColorFactor
    if factor is not None and not (_to_unit(np.reshape(factor, (1, -1))) == 1.0).all():
        colors = (np.ones((n, 3)) if colors is None else colors) * _to_unit(np.reshape(factor, (1, -1)))
    uvs = None if visual.uv is None else np.asarray(visual.uv, dtype=np.float64)
    image = visual.material.baseColorTexture if uvs is not None else None
    return colors, uvs, image


def _to_unit(colors: Any) -> NDArray[np.float64]:
    """Turn colours (n, 3 or 4) of any type into shares of one; opacity is left out."""
    colors = np.asarray(colors)[:, :3]
    largest = 1.0 if colors.dtype.kind == "f" else float(np.iinfo(colors.dtype).max)
    return np.asarray(np.clip(colors.astype(np.float64) / largest, 0.0, 1.0))


def _join(parts: list[_Part], to_texture: Callable[[Any], Any]) -> MeshArrays:
    """Put the parts one after the other."""
    if not parts:
        return MeshArrays(vertices=np.zeros((0, 3)), faces=np.zeros((0, 3), dtype=np.int64))
    starts = np.cumsum([0, *(len(part.vertices) for part in parts)])
    colored = any(part.colors is not None for part in parts)
    mapped = any(part.triangle_uvs is not None for part in parts)
    slots: dict[int, int] = {}
    textures: list[NDArray[np.uint8]] = []
    for part in parts:
        if id(part.image) not in slots:
            texture = None if part.image is None else to_texture(part.image)
            slots[id(part.image)] = len(textures)
            textures.append(WHITE if texture is None else texture)
    textured = any(texture is not WHITE for texture in textures)
    return MeshArrays(
        vertices=np.concatenate([part.vertices for part in parts]),
        faces=np.concatenate([part.faces + start for part, start in zip(parts, starts[:-1], strict=True)]),
        colors=np.concatenate([_or_fill(part.colors, len(part.vertices), 3, 1.0) for part in parts])
        if colored
        else None,
        normals=np.concatenate([part.normals for part in parts if part.normals is not None])
        if all(part.normals is not None for part in parts)
        else None,
        triangle_uvs=np.concatenate(
            [_or_fill(part.triangle_uvs, 3 * len(part.faces), 2, 0.5) for part in parts]
        )
        if mapped
        else None,
        material_ids=np.concatenate([np.full(len(part.faces), slots[id(part.image)]) for part in parts])
        if textured
        else None,
        textures=tuple(textures) if textured else (),
    )


def _or_fill(
    values: NDArray[np.float64] | None, rows: int, columns: int, value: float
) -> NDArray[np.float64]:
    return np.full((rows, columns), value) if values is None else values
