"""Cotangent weights and Laplacians (Appendix III)."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

__all__ = ["cotangent_laplacian", "mended_cotangents", "vertex_areas"]

_SLACK = 1e-3
"""A triangle whose longest edge is shorter than the two others together by less than this share of it
is a sliver. The cotangents of what is left stay below a thousand."""


def mended_cotangents(
    vertices: NDArray[np.float64], faces: NDArray[np.int64]
) -> tuple[NDArray[np.float64], int]:
    """Compute the cotangents of the corners of each triangle, robust to slivers.

    The cotangents of a zero-area triangle are infinite. Each sliver is therefore mended by itself: one
    length is added to its three edges, the least that makes the triangle inequality hold by a thousandth
    of the longest edge. Any three lengths that fulfil it are a triangle, so that the energy of the mended
    face stays positive; clamping single cotangents would not guarantee that. Other triangles are
    untouched and have the exact cotangents of Appendix III.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int64
        No face may have two corners at one position with its third corner there, too.

    Returns
    -------
    cotangents : (m, 3) float64
        Of the angle at each corner.
    slivers : int
        Number of triangles that were mended.

    Examples
    --------
    >>> right = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]])
    >>> mended_cotangents(right, np.array([[0, 1, 2]]))[0].round(12) + 0.0
    array([[0., 1., 1.]])
    """
    corners = vertices[faces]
    lengths = np.linalg.norm(corners[:, [2, 0, 1]] - corners[:, [1, 2, 0]], axis=2)
    longest = lengths.max(axis=1)
    slack = lengths.sum(axis=1) - 2.0 * longest
    missing = _SLACK * longest - slack
    sliver = missing > 0.0
    # Adding e to all three edges raises the slack by e and the wanted slack by _SLACK * e.
    lengths = lengths + (np.maximum(missing, 0.0) / (1.0 - _SLACK))[:, None]
    squared = lengths**2
    a, b, c = lengths.T
    # Heron's formula in the order that keeps its factors accurate for thin triangles.
    sixteen_area_squared = (a + b + c) * (b + c - a) * (c + a - b) * (a + b - c)
    four_area = np.sqrt(sixteen_area_squared)
    cotangents = (squared.sum(axis=1, keepdims=True) - 2.0 * squared) / four_area[:, None]
    return cotangents, int(sliver.sum())


def cotangent_laplacian(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    *,
    weights: NDArray[np.float64] | None = None,
) -> tuple[sp.csr_array, int]:
    """Assemble the symmetric cotangent Laplacian C.

    C_ij = -(cot a_ij + cot b_ij) / 2 off the diagonal and rows that sum to zero: the weights of
    Appendix III without the division by the Voronoi area, which scales whole rows and so does not change
    the solution of Eq. 7. C is positive semi-definite; its kernel holds the functions that are constant on
    each connected component. Edges with more than two faces add up all of them.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int64
    weights : (m,) float64, optional
        Factor of the cotangents of each face; 1 where omitted.

    Returns
    -------
    laplacian : (n, n) sparse float64, CSR
        In no unit: cotangents do not depend on the scale.
    slivers : int
        Number of triangles that were mended, see `mended_cotangents`.
    """
    cotangents, slivers = mended_cotangents(vertices, faces)
    if weights is not None:
        cotangents = cotangents * weights[:, None]
    n = len(vertices)
    start = faces[:, [1, 2, 0]].ravel()
    end = faces[:, [2, 0, 1]].ravel()
    weight = 0.5 * cotangents.ravel()
    half = sp.coo_array((weight, (np.minimum(start, end), np.maximum(start, end))), shape=(n, n)).tocsr()
    weights = half + half.T
    diagonal = sp.dia_array((weights.sum(axis=1)[None, :], [0]), shape=(n, n))
    return (diagonal - weights).tocsr(), slivers


def vertex_areas(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return the area of each vertex, a third of that of its faces.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int64

    Returns
    -------
    (n,) float64

    Examples
    --------
    >>> vertex_areas(np.array([[0, 0, 0], [3, 0, 0], [0, 2, 0.0]]), np.array([[0, 1, 2]])).tolist()
    [1.0, 1.0, 1.0]
    """
    a, b, c = vertices[faces].transpose(1, 0, 2)
    thirds = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 6.0
    areas = np.bincount(faces.ravel(), weights=np.repeat(thirds, 3), minlength=len(vertices))
    return areas.astype(np.float64)
