"""Meshes of any size from a real one, for benchmarks of speed."""

from __future__ import annotations

import numpy as np
import open3d as o3d

NOISE = 0.02
"""Standard deviation of the noise, as a share of the mean length of the edges."""


def refined(mesh: o3d.geometry.TriangleMesh, vertices: int, *, seed: int = 0) -> o3d.geometry.TriangleMesh:
    """Return a mesh of the same shape with about so many vertices.

    It is decimated as far as needed, each of its triangles is split into four at the middles of its edges
    until it is large enough, and the vertices get a little noise, so that no four of them lie in one plane.

    Parameters
    ----------
    mesh : open3d.geometry.TriangleMesh
        Not changed. Its attributes are left out.
    vertices : int
    seed : int
        Of the noise.

    Returns
    -------
    open3d.geometry.TriangleMesh
    """
    plain = o3d.geometry.TriangleMesh(mesh.vertices, mesh.triangles).remove_duplicated_vertices()
    faces, splits = 2 * vertices, 0  # of a closed surface
    while faces > len(plain.triangles):
        faces, splits = faces // 4, splits + 1
    if faces < len(plain.triangles):
        plain = plain.simplify_quadric_decimation(faces)
    if splits == 0:
        return plain
    plain = plain.subdivide_midpoint(splits)
    points, corners = np.array(plain.vertices), np.asarray(plain.triangles)
    edge = np.linalg.norm(points[corners[:, 0]] - points[corners[:, 1]], axis=1).mean()
    points += np.random.default_rng(seed).normal(scale=NOISE * edge, size=points.shape)
    plain.vertices = o3d.utility.Vector3dVector(points)
    return plain
