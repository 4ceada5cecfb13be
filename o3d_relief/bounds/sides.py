"""What views from the side would have of a relief.

From the side a flattened scene shows its surface at other places of the picture than the scene does: what
stood out has moved less. However well it keeps the normals, they are seen at the wrong place. So a relief
looks more like its scene from there if each place also leans a little to what the scene shows where it is.
"""

from __future__ import annotations

import numpy as np
import open3d as o3d
import scipy.sparse as sp
from numpy.typing import NDArray

from o3d_relief.linalg.laplacian import cotangent_laplacian
from o3d_relief.linalg.solve import solve_spd
from o3d_relief.rays import unit_box

__all__ = ["SIDES", "shown_normals", "side_pull", "smooth_pull", "tilt_pull", "vertex_masses"]

SIDES = ((-40.0, 0.0), (-20.0, 0.0), (20.0, 0.0), (40.0, 0.0), (0.0, -20.0), (0.0, 20.0))
"""The views from the side, degrees to the right and above."""

_SHARE, _MOST = 0.5, 0.8
"""How much the six views together count against the one from the front: at least, and at most."""

_DEEPER = 3.2
"""In between, so many times the relief's share of the scene's depth: a deep one has normals to give away."""

_WIDTH = 5.0
"""Relief units over which what the views ask for is evened out. Finer, a relief shows its details twice."""

_FIRST = 1e-3
"""Share of the relief's size within which a point counts as the first one that a ray meets."""

_LOOSE = 1e-9
"""Weight that keeps the system definite where no face counts."""


def side_pull(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    heights: NDArray[np.float64],
    seen: NDArray[np.bool_],
    weights: NDArray[np.float64],
    depth_share: float,
) -> NDArray[np.float64]:
    """Return what pulls a relief towards what views from the side see of the scene.

    Parameters
    ----------
    vertices : (n, 3) float64
        In the relief frame, in relief units.
    faces : (m, 3) int64
    heights : (n,) float64
        Of a relief about as deep as the one that is looked for, the middle of its visible depth at that of
        the scene: it says where the views see what.
    seen : (m,) bool
        Faces that are seen from the front.
    weights : (m,) float64
        How much each face counts, 1 is ordinary.
    depth_share : float
        Depth of the relief, as a share of that of the scene.

    Returns
    -------
    (n,) float64
        The force on each vertex along z, for the energy whose form is a weighted cotangent Laplacian; its
        sum over each component is 0.
    """
    normals = shown_normals(vertices, faces, heights, np.flatnonzero(seen & (weights > 0.0)))
    pull = min(max(_DEEPER * depth_share, _SHARE), _MOST) * tilt_pull(
        vertices, faces, normals * weights[:, None]
    )
    form, _ = cotangent_laplacian(vertices, faces, weights=weights)
    return smooth_pull(form, vertex_masses(vertices, faces, weights), pull, _WIDTH)


def shown_normals(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    heights: NDArray[np.float64],
    chosen: NDArray[np.int64],
) -> NDArray[np.float64]:
    """Find which normals the scene shows where a relief shows a face.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int64
    heights : (n,) float64
        Of the relief.
    chosen : (c,) int64
        Faces to find them for.

    Returns
    -------
    (m, 3) float64
        The mean over the views from the side: in each the normal of the triangle that the scene shows at the
        middle of the face of the relief, turned to the viewer, times the share of the face's area that is
        seen; 0 where that is hidden or turned away. 0 for all other faces.
    """
    relief = np.column_stack([vertices[:, :2], heights])
    scene, flat = _Surface(vertices, faces), _Surface(relief, faces)
    a, b, c = relief[faces[chosen]].transpose(1, 0, 2)
    middle, normal = (a + b + c) / 3.0, np.cross(b - a, c - a)
    size = np.linalg.norm(normal, axis=1)
    # The side of the face that the front sees.
    normal *= (np.sign(normal[:, 2]) / np.where(size > 0.0, size, 1.0))[:, None]
    total = np.zeros((len(chosen), 3))
    for view in SIDES:
        axis = _towards(*view)
        share = normal @ axis
        before, _ = flat.first_on(middle, axis)
        there = np.flatnonzero((share > 0.0) & (before <= _FIRST * flat.size))
        before, shown = scene.first_on(middle[there], axis)
        hit = np.isfinite(before)
        total[there[hit]] += share[there[hit], None] * shown[hit]
    result = np.zeros((len(faces), 3))
    result[chosen] = total / len(SIDES)
    return result


def tilt_pull(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], normals: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the force along z that tilts faces towards normals.

    A displacement d along z turns the unit normal n of a face by -n_z grad d. The product of its area A, n_z
    and n . m grows with d as -A n_z^2 m . grad d, and grad is the sum of the d_i times the gradients of the
    hat functions phi_i. Without the n_z^2, which the weights of the Dirichlet energy leave out as well, the
    force on the vertex i is -sum_f A_f m_f . grad phi_i.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int64
    normals : (m, 3) float64
        m_f.

    Returns
    -------
    (n,) float64

    Examples
    --------
    A level triangle that is to face the right goes down there:

    >>> corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    >>> tilt_pull(corners, np.array([[0, 1, 2]]), np.array([[1.0, 0, 0]])).tolist()
    [0.5, -0.5, 0.0]
    """
    a, b, c = vertices[faces].transpose(1, 0, 2)
    across = np.cross(b - a, c - a)
    size = np.linalg.norm(across, axis=1)
    across /= np.where(size > 0.0, size, 1.0)[:, None]
    pull = np.zeros(len(vertices))
    for corner, edge in zip(faces.T, (c - b, a - c, b - a), strict=True):
        force = -0.5 * (np.cross(across, edge) * normals).sum(axis=1)
        pull += np.bincount(corner, weights=force, minlength=len(vertices))
    return pull


def smooth_pull(
    form: sp.csr_array, masses: NDArray[np.float64], pull: NDArray[np.float64], width: float
) -> NDArray[np.float64]:
    """Even out a force over a surface: M (M + width^2 K)^-1 pull, which keeps the sum over each component.

    Parameters
    ----------
    form : (n, n) sparse float64
        K.
    masses : (n,) float64
        The diagonal of M.
    pull : (n,) float64
    width : float
        How far, in the unit of the vertices.

    Returns
    -------
    (n,) float64
    """
    diffusion = (width**2 * form + sp.diags_array(masses + _LOOSE)).tocsr()
    return masses * solve_spd(diffusion, pull, tolerance=1e-8)


def vertex_masses(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], weights: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the mass of each vertex, (n,): a third of the areas of its faces times their weights."""
    a, b, c = vertices[faces].transpose(1, 0, 2)
    third = weights * np.linalg.norm(np.cross(b - a, c - a), axis=1) / 6.0
    return np.asarray(np.bincount(faces.T.ravel(), np.tile(third, 3), len(vertices)), dtype=np.float64)


def _towards(yaw: float, pitch: float) -> NDArray[np.float64]:
    """Return the direction to a viewer, (3,)."""
    right, above = np.deg2rad([yaw, pitch])
    return np.array([np.sin(right) * np.cos(above), np.sin(above), np.cos(right) * np.cos(above)])


class _Surface:
    """A surface to look at from the side."""

    def __init__(self, vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> None:
        self._scene, self._middle, self.size = unit_box(vertices, faces)

    def first_on(
        self, points: NDArray[np.float64], axis: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Look along lines through points, (p, 3), from where an axis, (3,), points to.

        Return how far before the point the surface is met, (p,), infinite where it is not, and its normal
        there, turned to the viewer, (p, 3).
        """
        places = (points - self._middle) / self.size
        # From a plane across the axis: all corners of the unit box are nearer than one to its middle.
        ahead = 1.0 - places @ axis
        rays = np.empty((len(points), 6), dtype=np.float32)
        rays[:, :3], rays[:, 3:] = places + ahead[:, None] * axis, -axis
        hits = self._scene.cast_rays(o3d.core.Tensor(rays))
        met = hits["t_hit"].numpy().astype(np.float64)
        before = np.where(np.isfinite(met), (ahead - met) * self.size, np.inf)
        normal = hits["primitive_normals"].numpy().astype(np.float64)
        normal *= np.where(normal @ axis < 0.0, -1.0, 1.0)[:, None]
        return before, normal
