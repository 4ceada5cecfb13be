"""Meshes to files: all or nothing."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from o3d_relief.errors import FileError, MeshError
from o3d_relief.files import check_place, write_files
from o3d_relief.scene.arrays import MeshArrays, from_open3d
from o3d_relief.scene.encode import encode_glb, encode_obj, encode_ply, encode_stl

if TYPE_CHECKING:
    import open3d as o3d

__all__ = ["WRITABLE", "check_writable", "write_mesh"]

WRITABLE = (".ply", ".obj", ".stl", ".glb")
"""The file endings that `write_mesh` writes."""


def check_writable(path: str | Path) -> None:
    """Check, before any long work, that a mesh can be written to a file.

    Parameters
    ----------
    path : str or Path
        The file to be written. It may exist already: it will be replaced.

    Raises
    ------
    FileError
        An ending that cannot be written, a folder in place of a file, a folder that is missing or in
        which nothing can be written.

    Examples
    --------
    >>> check_writable("relief.ply")
    """
    path = Path(path)
    if path.suffix.lower() not in WRITABLE:
        raise FileError(f"{path} cannot be written: its ending must be one of {', '.join(WRITABLE)}.")
    check_place(path)


def write_mesh(path: str | Path, mesh: o3d.geometry.TriangleMesh) -> None:
    """Write a mesh as PLY, OBJ, STL or GLB, by the file's ending.

    PLY keeps vertices and normals exactly and colours in 8 bits, no textures. OBJ keeps vertices, normals
    and texture coordinates exactly, colours in six digits, textures as PNG files beside it. STL keeps
    the triangles in float32. GLB keeps everything, in float32 and 8 bits. The same mesh gives the same
    bytes.

    The files are written under another name in the same folder and then renamed, the main file last:
    after a failure the folder is as it was.

    Parameters
    ----------
    path : str or Path
        The file; it is replaced if it exists. Material and texture files of `b.obj` are `b.mtl`, `b_0.png`...
    mesh : open3d.geometry.TriangleMesh
        At least one triangle. Never modified.

    Raises
    ------
    FileError
        The file cannot be written.
    MeshError
        No triangles, vertices that are not finite (or too large for float32), indices out of range.

    Examples
    --------
    >>> import open3d as o3d
    >>> write_mesh("box.ply", o3d.geometry.TriangleMesh.create_box())  # doctest: +SKIP
    """
    check_writable(path)
    path = Path(path)
    arrays = from_open3d(mesh)
    _check_arrays(path, arrays)
    ending = path.suffix.lower()
    if ending == ".obj":
        files = encode_obj(arrays, path.stem)
        files[path.name] = files.pop(f"{path.stem}.obj")
    elif ending == ".ply":
        files = {path.name: encode_ply(arrays)}
    elif ending == ".stl":
        files = {path.name: encode_stl(arrays)}
    else:
        files = {path.name: encode_glb(arrays)}
    write_files(path, files)


def _check_arrays(path: Path, arrays: MeshArrays) -> None:
    if len(arrays.faces) == 0:
        raise MeshError(f"{path} is not written: the mesh has no triangles.")
    if arrays.faces.min() < 0 or arrays.faces.max() >= len(arrays.vertices):
        raise MeshError(f"{path} is not written: the mesh has triangles whose vertices do not exist.")
    if not np.isfinite(arrays.vertices).all():
        raise MeshError(f"{path} is not written: the mesh has vertices that are not finite.")
    if path.suffix.lower() in (".stl", ".glb") and np.abs(arrays.vertices).max() > np.finfo(np.float32).max:
        raise MeshError(f"{path} is not written: the mesh is too large for this format; write PLY or OBJ.")
