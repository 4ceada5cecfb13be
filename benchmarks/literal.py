"""The paper as anyone would first write it down, for `speed.py` to compare with.

Library k-means with its defaults, a general sparse LU of the literal systems, Python loops over
neighbourhoods.
"""

from __future__ import annotations

import time

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sla
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from sklearn.cluster import KMeans

from o3d_relief.stages.visibility import visible_vertices

BETA, DISCARD_ABOVE, ATTACH_BELOW, MAX_ORDER_ERROR, BLEND = 0.2, 0.6, 0.3, 0.2, 0.9
NEIGHBOURS = 4


def literal_relief(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], k: int
) -> tuple[NDArray[np.float64], NDArray[np.int64], dict[str, float]]:
    """Make a relief of a scene that is welded and in relief units.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int64
    k : int

    Returns
    -------
    z : (n,) float64
    faces : (m_out, 3) int64
        Those in front of S.
    seconds : dict of str to float
        Wall time of each stage.
    """
    seconds: dict[str, float] = {}
    since = time.perf_counter()

    def done(stage: str) -> None:
        nonlocal since
        seconds[stage] = time.perf_counter() - since
        since = time.perf_counter()

    visible = visible_vertices(vertices, faces)
    done("visibility")
    labels = KMeans(n_clusters=k, random_state=0).fit(vertices[:, :2]).labels_
    done("clusters")
    points, heights = _points(vertices, labels, visible, k)
    done("attenuation")
    laplacian = _laplacian(vertices, faces, areas=True)
    z = _solve(laplacian, vertices[:, 2], heights, points)
    done("construction")
    high = np.flatnonzero(_order_errors(vertices, z, labels, points) >= MAX_ORDER_ERROR)
    plain = _laplacian(vertices, faces, areas=False)
    blended = BLEND * plain + (1.0 - BLEND) * plain @ plain
    held = np.setdiff1d(np.arange(len(z)), high)
    z = _solve(blended.tocsr(), vertices[:, 2], z[held], held)
    done("restoration")
    in_front = faces[(z[faces] >= 0.0).all(axis=1)]
    done("trim")
    return z, in_front, seconds


def _points(
    vertices: NDArray[np.float64], labels: NDArray[np.int32], visible: NDArray[np.bool_], k: int
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Choose the attenuation points and find their new heights, Eqs. 1-5."""
    chosen = []
    for cluster in range(k):
        members = np.flatnonzero((labels == cluster) & visible)
        if len(members):
            chosen.append(members[vertices[members, 2].argmin()])
    index = np.array(chosen)
    differential = _directed(vertices[index]) @ vertices[index, 2]
    rho = (differential - differential.min()) / np.ptp(differential)
    kept = rho <= DISCARD_ABOVE
    index, rho = index[kept], rho[kept]
    matrix = _directed(vertices[index])
    wanted = np.arctan(BETA * (matrix @ vertices[index, 2])) / BETA
    attached = np.flatnonzero(rho < ATTACH_BELOW)
    rows = np.concatenate([matrix, np.eye(len(index))[attached]])
    target = np.concatenate([wanted, np.zeros(len(attached))])
    return index, np.linalg.lstsq(rows, target, rcond=None)[0]


def _directed(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """L = I - D^-1 A of the four nearest neighbours in x and y."""
    matrix = np.eye(len(points))
    for i, point in enumerate(points):
        distance = np.linalg.norm(points[:, :2] - point[:2], axis=1)
        for j in np.argsort(distance)[1 : NEIGHBOURS + 1]:
            matrix[i, j] = -1.0 / NEIGHBOURS
    return matrix


def _laplacian(vertices: NDArray[np.float64], faces: NDArray[np.int64], *, areas: bool) -> sp.csr_array:
    """Appendix III: cotangent weights, divided by the Voronoi areas or, for Appendix VI, by their sums."""
    n = len(vertices)
    weights = sp.csr_array((n, n))
    area = np.zeros(n)
    for corner in range(3):
        k, i, j = faces[:, corner], faces[:, (corner + 1) % 3], faces[:, (corner + 2) % 3]
        u, v = vertices[i] - vertices[k], vertices[j] - vertices[k]
        cotangent = (u * v).sum(axis=1) / np.maximum(np.linalg.norm(np.cross(u, v), axis=1), 1e-12)
        weights = weights + sp.csr_array((0.5 * cotangent, (i, j)), shape=(n, n))
        weights = weights + sp.csr_array((0.5 * cotangent, (j, i)), shape=(n, n))
        eighth = ((vertices[i] - vertices[j]) ** 2).sum(axis=1) * cotangent / 8.0
        np.add.at(area, i, eighth)
        np.add.at(area, j, eighth)
    total = weights.sum(axis=1)
    divisor = area if areas else total
    divisor = np.where(np.abs(divisor) > 1e-12, divisor, 1.0)
    return (sp.diags_array(1.0 / divisor) @ (sp.diags_array(total) - weights)).tocsr()


def _solve(
    laplacian: sp.csr_array,
    original: NDArray[np.float64],
    heights: NDArray[np.float64],
    fixed: NDArray[np.int64],
) -> NDArray[np.float64]:
    """Appendix V: rows of L for the free vertices, of the identity for the fixed ones; one general LU."""
    target = laplacian @ original
    target[fixed] = heights
    is_fixed = np.zeros(len(original))
    is_fixed[fixed] = 1.0
    matrix = sp.diags_array(1.0 - is_fixed) @ laplacian + sp.diags_array(is_fixed)
    return np.asarray(sla.splu(matrix.tocsc()).solve(target))


def _order_errors(
    vertices: NDArray[np.float64],
    z: NDArray[np.float64],
    labels: NDArray[np.int32],
    points: NDArray[np.int64],
) -> NDArray[np.float64]:
    """Eq. 8, neighbourhood by neighbourhood and vertex by vertex."""
    tree = cKDTree(vertices)
    error = np.zeros(len(z))
    for point in points:
        members = vertices[labels == labels[point], :2]
        radius = max(np.linalg.norm(members - member, axis=1).max() for member in members[::16]) / 2.0
        around = tree.query_ball_point(vertices[point], radius)
        before = {vertex: rank for rank, vertex in enumerate(sorted(around, key=lambda i: vertices[i, 2]))}
        after = {vertex: rank for rank, vertex in enumerate(sorted(around, key=lambda i: z[i]))}
        for vertex in around:
            error[vertex] = max(error[vertex], abs(after[vertex] - before[vertex]) / len(around))
    return error
