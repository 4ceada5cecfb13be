"""Open3D meshes to arrays and back: the border at which meshes are checked once."""

from __future__ import annotations

from os import PathLike

import numpy as np
import open3d as o3d
from numpy.typing import ArrayLike, NDArray

from o3d_relief.errors import MeshError
from o3d_relief.limits import check_triangles

__all__ = ["arrays_mesh", "check_mesh", "mesh_arrays"]

_LARGEST = 1e50
"""Squared areas of larger scenes, and of scenes smaller than the inverse, leave the range of float64."""


def check_mesh(name: str, mesh: object) -> None:
    """Check that something is an Open3D mesh.

    Parameters
    ----------
    name : str
        What it is called in the sentence.
    mesh : object

    Raises
    ------
    MeshError
        It is none; the sentence says how to make one where that is known.
    """
    if isinstance(mesh, o3d.geometry.TriangleMesh):
        return
    kind, advice = f"{type(mesh).__module__}.{type(mesh).__qualname__}", ""
    if isinstance(mesh, str | PathLike):
        advice = ": read the file with read_mesh"
    elif isinstance(mesh, o3d.t.geometry.TriangleMesh | o3d.t.geometry.PointCloud):
        advice = ": take what its to_legacy() returns"
    elif isinstance(mesh, o3d.geometry.PointCloud):
        advice = ": make a mesh of it with mesh_from_points"
    elif isinstance(getattr(mesh, "mesh", None), o3d.geometry.TriangleMesh):
        advice = ": take its mesh"
    raise MeshError(f"{name} must be an open3d.geometry.TriangleMesh. Got a {kind} instead{advice}.")


def mesh_arrays(
    mesh: o3d.geometry.TriangleMesh, max_triangles: int | None = None
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Copy vertices and faces out of an Open3D mesh and check them.

    Parameters
    ----------
    mesh : open3d.geometry.TriangleMesh
        Never modified.
    max_triangles : int, optional
        Larger meshes are refused; 10,000,000 where omitted.

    Returns
    -------
    vertices : (n, 3) float64
    faces : (m, 3) int64

    Raises
    ------
    ParameterError
        `max_triangles` is not a positive whole number.
    MeshError
        Not a TriangleMesh, too large for `max_triangles` or for the memory, no vertices, no triangles,
        indices out of range, or vertices of faces that are not finite or too large or small to compute with.
    """
    check_mesh("The scene", mesh)
    check_triangles(len(mesh.triangles), max_triangles)
    vertices = np.array(mesh.vertices, dtype=np.float64).reshape(-1, 3)
    faces = np.array(mesh.triangles, dtype=np.int64).reshape(-1, 3)
    if len(vertices) == 0:
        raise MeshError("The mesh is empty: it has no vertices.")
    if len(faces) == 0:
        raise MeshError(f"The mesh has no triangles, only {len(vertices)} vertices: it must be meshed first.")
    low, high = int(faces.min()), int(faces.max())
    if low < 0 or high >= len(vertices):
        wrong = low if low < 0 else high
        raise MeshError(
            f"A triangle names vertex {wrong}, but the mesh has the vertices 0 to {len(vertices) - 1}: "
            "the mesh is damaged."
        )
    used = np.zeros(len(vertices), dtype=bool)
    used[faces] = True
    finite = np.asarray(np.isfinite(vertices).all(axis=1))
    if not finite[used].all():
        bad = int((~finite[faces]).any(axis=1).sum())
        raise MeshError(
            f"The mesh has vertices that are not finite numbers, in {bad} of its {len(faces)} triangles: "
            "remove these first."
        )
    _check_size(vertices[used])
    return vertices, faces


def _check_size(used: NDArray[np.float64]) -> None:
    largest = float(np.abs(used).max())
    if largest > _LARGEST:
        raise MeshError(
            f"The mesh has coordinates up to {largest:.0e}, and {_LARGEST:.0e} is the most that can be "
            "computed with: scale it down first."
        )
    extent = float(np.ptp(used, axis=0).max())
    if 0.0 < extent < 1.0 / _LARGEST:
        raise MeshError(
            f"The mesh is only {extent:.0e} large, and {1.0 / _LARGEST:.0e} is the least that can be "
            "computed with: scale it up first."
        )


def arrays_mesh(vertices: ArrayLike, faces: ArrayLike) -> o3d.geometry.TriangleMesh:
    """Copy vertices and faces into an Open3D mesh.

    Parameters
    ----------
    vertices : (n, 3) float
    faces : (m, 3) int

    Raises
    ------
    MeshError
        Arrays of other shapes.
    """
    places, corners = np.asarray(vertices, dtype=np.float64), np.asarray(faces)
    for name, array in (("vertices", places), ("faces", corners)):
        if array.ndim != 2 or array.shape[1] != 3:
            raise MeshError(f"{name} must be of the shape (count, 3). Got {array.shape} instead.")
    return o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector(places), o3d.utility.Vector3iVector(corners.astype(np.int32))
    )
