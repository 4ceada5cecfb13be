"""Screened Poisson reconstruction, with everything checked that would end the process inside Open3D."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from o3d_relief.errors import MeshError, ParameterError

__all__ = ["depth_for", "poisson_surface"]

_LEAST_POINTS = 50
"""Fewer points give no surface, and single ones end the process."""

_MARGIN = 1.1
"""Width of the octree in extents of the cloud."""

_DEEPEST = 11
"""The depth that is chosen without being asked: extents of 2,000 spacings."""


def depth_for(extent: float, spacing: float) -> int:
    """Choose the depth of the octree: its cells become 0.84 to 1.68 spacings wide.

    Parameters
    ----------
    extent, spacing : float
        In one unit.

    Returns
    -------
    int
        From 4 to 11.

    Examples
    --------
    >>> depth_for(100.0, 1.0)
    7
    """
    return int(np.clip(np.floor(np.log2(_MARGIN * extent / spacing) + 0.25), 4, _DEEPEST))


def poisson_surface(
    points: NDArray[np.float64], normals: NDArray[np.float64], *, depth: int, threads: int
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.float64]]:
    """Reconstruct a closed surface from oriented points.

    Kazhdan and Hoppe, "Screened Poisson Surface Reconstruction" (2013), in Open3D.

    Parameters
    ----------
    points : (n, 3) float64
        No two alike, near the origin compared with their spacing.
    normals : (n, 3) float64
        Unit vectors that point out of the surface.
    depth : int
        Of the octree.
    threads : int

    Returns
    -------
    vertices : (v, 3) float64
    faces : (f, 3) int64
    density : (v,) float64
        Depth of the octree at which the points reach their sampling density.

    Raises
    ------
    MeshError
        Too few points, points on a line, or no surface.
    ParameterError
        More threads than the machine has.
    """
    available = os.cpu_count() or 1
    if threads > available:  # Open3D would end the process
        raise ParameterError(
            f"threads must be at most {available}, the number of processors. Got {threads} instead."
        )
    if len(points) < _LEAST_POINTS:
        raise MeshError(f"A surface needs at least {_LEAST_POINTS} points, only {len(points)} are left.")
    centre = (points.min(axis=0) + points.max(axis=0)) / 2.0
    size = float(np.abs(points - centre).max())
    inside = (points - centre) / size
    if np.linalg.svd(np.linalg.qr(inside - inside.mean(axis=0), mode="r"), compute_uv=False)[1] < 1e-6:
        raise MeshError("The points lie on one line: they have no surface.")
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(inside))
    cloud.normals = o3d.utility.Vector3dVector(normals)
    with o3d.utility.VerbosityContextManager(o3d.utility.VerbosityLevel.Error), _unheard():
        mesh, density = o3d.geometry.TriangleMesh.create_from_point_cloud_poisson(
            cloud, depth=depth, scale=_MARGIN, n_threads=threads
        )
    if len(mesh.triangles) == 0:
        raise MeshError("No surface could be laid through the points.")
    vertices = np.asarray(mesh.vertices) * size + centre
    return vertices, np.array(mesh.triangles, dtype=np.int64), np.array(density, dtype=np.float64)


@contextmanager
def _unheard() -> Iterator[None]:
    """Keep what the library below Open3D writes past Python, its own lines, off the error stream."""
    if sys.stderr is not None:
        sys.stderr.flush()
    try:
        kept = os.dup(2)
    except OSError:  # a process without an error stream
        yield
        return
    try:
        with Path(os.devnull).open("w") as sink:
            os.dup2(sink.fileno(), 2)
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
