"""Meshes to files: all or nothing."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from o3d_relief.errors import FileError, MeshError
from o3d_relief.files import check_place, write_files
from o3d_relief.scene.arrays import MeshArrays, from_open3d
from o3d_relief.scene.convert import check_mesh
from o3d_relief.scene.encode import encode_mesh

if TYPE_CHECKING:
    import open3d as o3d

__all__ = ["WRITABLE", "check_writable", "lost_attributes", "mesh_files", "write_mesh"]

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


def lost_attributes(path: str | Path, mesh: o3d.geometry.TriangleMesh) -> list[str]:
    """Say what of a mesh the format of a file cannot hold.

    Parameters
    ----------
    path : str or Path
        The file to be written.
    mesh : open3d.geometry.TriangleMesh

    Returns
    -------
    list of str
        A sentence, or nothing.

    Examples
    --------
    >>> import open3d as o3d
    >>> lost_attributes("relief.stl", o3d.geometry.TriangleMesh.create_box().paint_uniform_color((1, 0, 0)))
    ['relief.stl will have no colours: STL cannot hold them; OBJ and GLB can']
    """
    ending = Path(path).suffix.lower()
    textured = mesh.has_triangle_uvs() and mesh.has_textures()
    lost = ["colours"] if ending == ".stl" and mesh.has_vertex_colors() else []
    lost += ["textures"] if ending in (".stl", ".ply") and textured else []
    if not lost:
        return []
    form = ending[1:].upper()
    return [f"{path} will have no {' and no '.join(lost)}: {form} cannot hold them; OBJ and GLB can"]


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
        The file; it is replaced if it exists. Material and texture files of `b.obj` are `b.mtl`,
        `b_0.png`...; their names have no spaces.
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
    write_files(path, mesh_files(path, mesh))


def mesh_files(path: str | Path, mesh: o3d.geometry.TriangleMesh) -> dict[str, bytes]:
    """Return the files that `write_mesh` writes.

    Parameters
    ----------
    path : str or Path
    mesh : open3d.geometry.TriangleMesh

    Returns
    -------
    dict of str to bytes
        Contents by name; the main file last.

    Raises
    ------
    MeshError
        As for `write_mesh`.
    """
    path = Path(path)
    check_mesh("The mesh to write", mesh)
    arrays = from_open3d(mesh)
    _check_arrays(path, arrays)
    return encode_mesh(arrays, path.name)


def _check_arrays(path: Path, arrays: MeshArrays) -> None:
    if len(arrays.faces) == 0:
        raise MeshError(f"{path} is not written: the mesh has no triangles.")
    if arrays.faces.min() < 0 or arrays.faces.max() >= len(arrays.vertices):
        raise MeshError(f"{path} is not written: the mesh has triangles whose vertices do not exist.")
    if not np.isfinite(arrays.vertices).all():
        raise MeshError(f"{path} is not written: the mesh has vertices that are not finite.")
    if path.suffix.lower() in (".stl", ".glb") and np.abs(arrays.vertices).max() > np.finfo(np.float32).max:
        raise MeshError(f"{path} is not written: the mesh is too large for this format; write PLY or OBJ.")
