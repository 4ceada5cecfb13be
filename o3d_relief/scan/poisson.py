"""Screened Poisson reconstruction, with everything checked that would end the process inside Open3D."""

from __future__ import annotations

import os

import numpy as np
from numpy.typing import NDArray

from o3d_relief.errors import MeshError, ParameterError
from o3d_relief.progress import Tick, silent
from o3d_relief.scan.poisson_open3d import Surface, reconstruct
from o3d_relief.scan.poisson_process import reconstruct_apart

__all__ = ["depth_for", "poisson_surface"]

_LEAST_POINTS = 50
"""Fewer points give no surface, and single ones end the process."""

_MARGIN = 1.1
"""Width of the octree in extents of the cloud."""

_MANY, _FINE = 20_000, 8
"""More points, or a deeper octree, take longer than it takes to start another process."""

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
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    *,
    depth: int,
    threads: int,
    tick: Tick = silent,
) -> Surface:
    """Reconstruct a closed surface from oriented points.

    Kazhdan and Hoppe, "Screened Poisson Surface Reconstruction" (2013), in Open3D. Where that takes longer
    than a second or two it runs in a process of its own: Open3D cannot be interrupted.

    Parameters
    ----------
    points : (n, 3) float64
        No two alike, near the origin compared with their spacing.
    normals : (n, 3) float64
        Unit vectors that point out of the surface.
    depth : int
        Of the octree.
    threads : int
    tick : callable
        Called now and then while the process runs; may call the work off.

    Returns
    -------
    vertices : (v, 3) float64
    faces : (f, 3) int64
    density : (v,) float64
        Depth of the octree at which the points reach their sampling density.

    Raises
    ------
    MeshError
        Too few points, points on a line, no surface, or the process broke.
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
    if len(points) > _MANY or depth > _FINE:
        found = reconstruct_apart(inside, normals, depth, threads, _MARGIN, tick)
    else:
        found = reconstruct(inside, normals, depth, threads, _MARGIN)
    vertices, faces, density = found
    if len(faces) == 0:
        raise MeshError("No surface could be laid through the points.")
    return vertices * size + centre, faces, density
