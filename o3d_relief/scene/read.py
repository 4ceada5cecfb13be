"""Meshes and point clouds from files: one strict reader for each format."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from o3d_relief.errors import FileError, MeshError
from o3d_relief.limits import check_file_size
from o3d_relief.scene.arrays import CloudArrays, MeshArrays, to_open3d
from o3d_relief.scene.gltf import decode_gltf
from o3d_relief.scene.las import decode_las
from o3d_relief.scene.named_files import NamedFiles, to_texture
from o3d_relief.scene.obj import decode_obj
from o3d_relief.scene.off import decode_off
from o3d_relief.scene.pcd import decode_pcd
from o3d_relief.scene.ply import decode_ply
from o3d_relief.scene.point_lists import decode_point_list
from o3d_relief.scene.stl import decode_stl

if TYPE_CHECKING:
    import open3d as o3d

__all__ = ["READABLE", "READABLE_CLOUDS", "left_out", "read_arrays", "read_mesh", "read_points"]

READABLE = (".ply", ".obj", ".stl", ".off", ".glb", ".gltf")
"""The file endings that `read_mesh` reads."""

READABLE_CLOUDS = (".pcd", ".xyz", ".xyzn", ".xyzrgb", ".pts", ".las", ".laz")
"""The file endings that only point clouds have; PLY, OBJ and OFF files may hold some, too."""


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
    arrays = read_arrays(path)
    if isinstance(arrays, CloudArrays):
        raise MeshError(
            f"{path} has no triangles, only {len(arrays.points)} points: read this cloud with read_points."
        )
    return to_open3d(arrays)


def read_points(path: str | Path) -> o3d.geometry.PointCloud:
    """Read a point cloud from a PLY, PCD, XYZ, PTS, LAS or LAZ file, or an OBJ or OFF file without faces.

    Points keep the order of the file. Colours and normals come along as they are. Points that are not
    finite are read as they are. LAS and LAZ need the packages laspy and lazrs.

    Parameters
    ----------
    path : str or Path
        The file.

    Returns
    -------
    open3d.geometry.PointCloud
        At least one point, in the file's unit and frame.

    Raises
    ------
    FileError
        The file is missing, unreadable, damaged, too short, or of a format that is not read.
    MeshError
        The file has triangles, or nothing in it.

    Examples
    --------
    >>> cloud = read_points("scan.ply")  # doctest: +SKIP
    """
    arrays = read_arrays(path)
    if isinstance(arrays, MeshArrays):
        raise MeshError(f"{path} is a mesh of {len(arrays.faces)} triangles: read it with read_mesh.")
    return arrays.to_open3d()


def read_arrays(path: str | Path) -> MeshArrays | CloudArrays:
    """Read a mesh or a point cloud, whichever the file holds.

    Parameters
    ----------
    path : str or Path
        The file.

    Returns
    -------
    MeshArrays or CloudArrays
        A mesh with at least one triangle and all indices in range, or a cloud with at least one point.

    Raises
    ------
    FileError
        The file is missing, unreadable, damaged, too short, or of a format that is not read.
    MeshError
        There is nothing in the file.
    """
    path = Path(path)
    data = _read_bytes(path)
    try:
        if path.suffix.lower() in READABLE_CLOUDS:
            arrays: MeshArrays | CloudArrays = _decode_cloud(path, data)
        else:
            arrays = _decode(path, data)
            _check_indices(arrays)
    except FileError as error:
        raise FileError(f"{path} cannot be read: {error}. Export it again or use another copy.") from error
    if isinstance(arrays, MeshArrays) and len(arrays.faces) == 0:
        arrays = CloudArrays(points=arrays.vertices, colors=arrays.colors, normals=arrays.normals)
    if isinstance(arrays, CloudArrays) and len(arrays.points) == 0:
        raise MeshError(f"{path} has no triangles, nothing in it: use another copy.")
    return arrays


def left_out(path: str | Path, arrays: MeshArrays) -> list[str]:
    """Say what of a mesh file was left out.

    Parameters
    ----------
    path : str or Path
    arrays : MeshArrays
        What was read from it.

    Returns
    -------
    list of str
        A sentence each, none as a rule.
    """
    return [
        f"{path} names {name}, which cannot be read: what it colours is left plain" for name in arrays.missing
    ]


def _decode_cloud(path: Path, data: bytes) -> CloudArrays:
    kind = path.suffix.lower()
    if kind == ".pcd":
        return decode_pcd(data)
    return decode_las(data) if kind in (".las", ".laz") else decode_point_list(data)


def _read_bytes(path: Path) -> bytes:
    try:
        if path.is_dir():
            raise FileError(f"{path} is a folder: give the name of a file in it.")
        if not path.exists():
            raise FileError(f"{path} does not exist: check its name and folder.")
        if path.suffix.lower() not in READABLE + READABLE_CLOUDS:
            endings = ", ".join(READABLE + READABLE_CLOUDS)
            raise FileError(f"{path} cannot be read: its ending must be one of {endings}.")
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
    kind, named = path.suffix.lower()[1:], NamedFiles(path.parent)
    if kind == "ply":
        return decode_ply(data, named.texture)
    if kind == "obj":
        return decode_obj(data, named.read, named.texture)
    if kind == "stl":
        return decode_stl(data)
    if kind == "off":
        return decode_off(data)
    return decode_gltf(data, kind, named, to_texture)


def _check_indices(arrays: MeshArrays) -> None:
    """Refuse what would end the process inside Open3D."""
    faces = arrays.faces
    if len(faces) and (faces.min() < 0 or faces.max() >= len(arrays.vertices)):
        raise FileError("it has a face with a vertex that does not exist")
