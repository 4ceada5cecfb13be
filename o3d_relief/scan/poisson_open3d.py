"""Open3D's Poisson reconstruction, without what it says past Python."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

__all__ = ["Surface", "reconstruct"]

Surface = tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.float64]]
"""Vertices (v, 3), faces (f, 3), densities (v,)."""


def reconstruct(
    points: NDArray[np.float64], normals: NDArray[np.float64], depth: int, threads: int, scale: float
) -> Surface:
    """Reconstruct a closed surface in this process, which waits for it whatever happens.

    Parameters
    ----------
    points, normals : (n, 3) float64
        That do not end the process, see `o3d_relief.scan.poisson.poisson_surface`.
    depth, threads : int
    scale : float
        Width of the octree in extents of the points.

    Returns
    -------
    vertices : (v, 3) float64
    faces : (f, 3) int64
    density : (v,) float64
    """
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    cloud.normals = o3d.utility.Vector3dVector(normals)
    with o3d.utility.VerbosityContextManager(o3d.utility.VerbosityLevel.Error), _unheard():
        mesh, density = o3d.geometry.TriangleMesh.create_from_point_cloud_poisson(
            cloud, depth=depth, scale=scale, n_threads=threads
        )
    faces = np.array(mesh.triangles, dtype=np.int64)
    return np.array(mesh.vertices), faces, np.array(density, dtype=np.float64)


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
