"""Meshes from files: one strict reader for each format, behind one function."""

from __future__ import annotations

import warnings
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from o3d_relief.errors import FileError, MeshError
from o3d_relief.limits import check_file_size
from o3d_relief.scene.arrays import MeshArrays, to_open3d
from o3d_relief.scene.gltf import decode_gltf
from o3d_relief.scene.obj import decode_obj
from o3d_relief.scene.off import decode_off
from o3d_relief.scene.ply import decode_ply
from o3d_relief.scene.stl import decode_stl

if TYPE_CHECKING:
    import open3d as o3d

__all__ = ["READABLE", "read_mesh", "read_mesh_and_notes"]

READABLE = (".ply", ".obj", ".stl", ".off", ".glb", ".gltf")
"""The file endings that `read_mesh` reads."""


def read_mesh(path: str | Path) -> o3d.geometry.TriangleMesh:
    """Read a triangle mesh from a PLY, OBJ, STL, OFF, GLB or glTF file.

    Vertices and faces keep the numbers that they have in the file, unused vertices too (an STL file has
    none: three for each triangle; the meshes of a GLB follow each other); polygons are cut into triangles
    round their first corner. Vertex colours, vertex normals, texture coordinates and
    textures come along where the format has them: the colour of a point is its texture times its vertex
    colour. Opacity is left out. Materials or textures in files that are missing are left out. Vertices that
    are not finite are read as they are.

    Parameters
    ----------
    path : str or Path
        The file.

    Returns
    -------
    open3d.geometry.TriangleMesh
        At least one triangle, all indices in range, vertices in float64 in the file's unit and frame.
        Row 0 of a texture is its bottom (v = 0), as in meshes that Open3D reads itself.

    Raises
    ------
    FileError
        The file is missing, unreadable, damaged, too short, of a format that is not read, or so large that
        reading it would need more memory than there is.
    MeshError
        The file has no triangles, for instance because it is a point cloud.

    Examples
    --------
    >>> mesh = read_mesh("box.ply")  # doctest: +SKIP
    """
    return read_mesh_and_notes(path)[0]


def read_mesh_and_notes(path: str | Path) -> tuple[o3d.geometry.TriangleMesh, list[str]]:
    """Read a mesh like `read_mesh`, and say what of the file was left out.

    Parameters
    ----------
    path : str or Path
        The file.

    Returns
    -------
    mesh : open3d.geometry.TriangleMesh
    notes : list of str
        A sentence each, none as a rule.

    Raises
    ------
    FileError, MeshError
        As by `read_mesh`.
    """
    path = Path(path)
    data = _read_bytes(path)
    try:
        arrays = _decode(path, data)
        _check_indices(arrays)
    except FileError as error:
        raise FileError(f"{path} cannot be read: {error}. Export it again or use another copy.") from error
    if len(arrays.faces) == 0:
        what = f"only {len(arrays.vertices)} points" if len(arrays.vertices) else "nothing in it"
        raise MeshError(f"{path} has no triangles, {what}: a relief needs a mesh, so make one first.")
    notes = [
        f"{path} names {name}, which cannot be read: what it colours is left plain" for name in arrays.missing
    ]
    return to_open3d(arrays), notes


def _read_bytes(path: Path) -> bytes:
    try:
        if path.is_dir():
            raise FileError(f"{path} is a folder: give the name of a file in it.")
        if not path.exists():
            raise FileError(f"{path} does not exist: check its name and folder.")
        if path.suffix.lower() not in READABLE:
            raise FileError(f"{path} cannot be read: its ending must be one of {', '.join(READABLE)}.")
        if not path.is_file():
            raise FileError(f"{path} cannot be read: it is a device or a pipe. Save it as a file first.")
        check_file_size(path, path.stat().st_size)
        data = path.read_bytes()
    except FileError:
        raise
    except OSError as error:
        raise FileError(f"{path} cannot be read: {error.strerror}. Check the file and its rights.") from error
    if not data:
        raise FileError(f"{path} is empty: export it again or use another copy.")
    return data


def _decode(path: Path, data: bytes) -> MeshArrays:
    kind = path.suffix.lower()[1:]

    def read_file(name: str) -> bytes | None:
        return _read_neighbour(path.parent, name)

    def read_texture(name: str) -> NDArray[np.uint8] | None:
        content = read_file(name)
        return None if content is None else _to_texture(BytesIO(content))

    if kind == "ply":
        return decode_ply(data, read_texture)
    if kind == "obj":
        return decode_obj(data, read_file, read_texture)
    if kind == "stl":
        return decode_stl(data)
    if kind == "off":
        return decode_off(data)
    return decode_gltf(data, kind, _Neighbours(path.parent), _to_texture)


class _Neighbours:
    """Finds the files that a glTF file names, for trimesh."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def get(self, name: str) -> bytes:
        content = _read_neighbour(self._folder, name)
        if content is None:
            content = _read_neighbour(self._folder, unquote(name))
        if content is None:
            raise FileNotFoundError(name)
        return content

    __getitem__ = get


def _read_neighbour(folder: Path, name: str) -> bytes | None:
    """Read a file that another one names; where its folder is unknown here, look beside the other one.

    None where there is none.
    """
    name = name.strip().strip('"').replace("\\", "/")
    for place in (folder / name, folder / Path(name).name):
        try:
            if place.is_file():  # a device would never end
                check_file_size(place, place.stat().st_size)
                return place.read_bytes()
        except (OSError, ValueError):  # one that is too large for the memory, too
            continue
    return None


def _to_texture(source: Any) -> NDArray[np.uint8] | None:
    """Turn a PIL picture, or a stream of one, into a texture (h, w, 3) with its bottom row first."""
    from PIL import Image

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of Pillow, on odd but readable pictures
        try:
            image = source if isinstance(source, Image.Image) else Image.open(source)
            pixels = np.asarray(image.convert("RGB"))
        except (OSError, SyntaxError, ValueError, Image.DecompressionBombError):
            return None
    return np.ascontiguousarray(pixels[::-1])


def _check_indices(arrays: MeshArrays) -> None:
    """Refuse what would end the process inside Open3D."""
    faces = arrays.faces
    if len(faces) and (faces.min() < 0 or faces.max() >= len(arrays.vertices)):
        raise FileError("it has a face with a vertex that does not exist")
