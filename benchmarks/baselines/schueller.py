"""Appearance-mimicking surfaces after Schüller, Panozzo and Sorkine-Hornung."""

from __future__ import annotations

import numpy as np
import open3d as o3d
import scipy.sparse as sp
from numpy.typing import NDArray

import o3d_relief as rel
from o3d_relief.errors import SolverError
from o3d_relief.linalg.laplacian import vertex_areas
from o3d_relief.linalg.quadratic import minimise
from o3d_relief.scene.convert import arrays_mesh
from o3d_relief.stages.visibility import visible_vertices

__all__ = ["appearance_mimicking", "energy"]

_HIDDEN = 0.1
"""Weight of hidden vertices against 1 of visible ones."""

_HOLD = 1e-9
"""Weight, per area, that holds loose parts where linear scaling puts them: the energy lets them slide freely.
A wave of 100 relief units costs ten thousand times as much."""


def energy(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], weights: NDArray[np.float64]
) -> sp.csr_array:
    """Return the quadratic form (n, n) of the change of the seen normals in the displacement along z.

    The publication moves each vertex along its ray from the viewer o, v = o + lambda v^, and measures

        sum over i of  w_i^2 A_i |(L v')_i - (L v)_i lambda'_i / lambda_i|^2,

    L the cotangent Laplacian divided by the vertex areas A: the mean curvature normals, as long as areas and
    curvatures are held. Where the viewer is infinitely far, the rays are parallel, all lambda'_i / lambda_i
    tend to 1, x and y stay, and d = z' - z remains: sum of w_i^2 A_i (L d)_i^2.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int64
    weights : (n,) float64
        w.
    """
    stiffness, _ = rel.cotangent_laplacian(vertices, faces)
    areas = vertex_areas(vertices, faces)
    factor = weights**2 / np.maximum(areas, 1e-6 * areas.mean())
    scale = sp.dia_array((factor[None], [0]), shape=stiffness.shape)
    return (stiffness.T @ scale @ stiffness).tocsr()


def appearance_mimicking(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    visible: NDArray[np.bool_],
    depth: float,
    *,
    largest: int = 20_000,
) -> NDArray[np.float64]:
    """Find the heights between 0 and `depth` that keep the seen normals best.

    C. Schüller, D. Panozzo, O. Sorkine-Hornung, "Appearance-mimicking surfaces", ACM Transactions on
    Graphics 33(6), 2014: a quadratic program over the mesh, see `energy`, with exact bounds on the depth of
    each vertex. All vertices are bounded, visible or not; the depth order of parts one behind the other is
    not.

    A larger mesh is decimated first, and each of its vertices takes the displacement of the nearest place of
    the small mesh, so that no detail is lost.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int64
    visible : (n,) bool
    depth : float
    largest : int
        Vertices that the program may have.

    Returns
    -------
    (n,) float64

    Raises
    ------
    SolverError
        The solver has given up.
    """
    if len(vertices) <= largest:
        return vertices[:, 2] + _displacement(vertices, faces, visible, depth)
    mesh = arrays_mesh(vertices, faces).simplify_quadric_decimation(int(len(faces) * largest / len(vertices)))
    mesh.remove_unreferenced_vertices()
    small, small_faces = np.array(mesh.vertices), np.array(mesh.triangles, dtype=np.int64)
    moved = _displacement(small, small_faces, visible_vertices(small, small_faces), depth)
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(
        o3d.core.Tensor(small.astype(np.float32)), o3d.core.Tensor(small_faces.astype(np.uint32))
    )
    nearest = scene.compute_closest_points(o3d.core.Tensor(vertices.astype(np.float32)))
    u, v = nearest["primitive_uvs"].numpy().astype(np.float64).T
    corners = moved[small_faces[nearest["primitive_ids"].numpy().astype(np.int64)]]
    z = vertices[:, 2] + (1.0 - u - v) * corners[:, 0] + u * corners[:, 1] + v * corners[:, 2]
    return np.asarray(np.clip(z, 0.0, depth))


def _displacement(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], visible: NDArray[np.bool_], depth: float
) -> NDArray[np.float64]:
    z, n = vertices[:, 2], len(vertices)
    low, high = z[visible].min(), z[visible].max()
    scaled = np.clip((z - low) * depth / (high - low), 0.0, depth)
    weights = np.where(visible, 1.0, _HIDDEN)
    form = energy(vertices, faces, weights)
    hold = _HOLD * vertex_areas(vertices, faces)
    inside = sp.vstack([sp.eye_array(n), -sp.eye_array(n)]).tocsr()
    displacement = minimise(
        (form + sp.dia_array((hold[None], [0]), shape=form.shape)).tocsr(),
        hold * (scaled - z),
        inside,
        np.concatenate([-z, z - depth]),
    )
    if displacement is None:
        raise SolverError(f"The quadratic program of {n} vertices was not solved.")
    return np.asarray(np.clip(z + displacement, 0.0, depth) - z)
