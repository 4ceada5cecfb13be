"""Cotangent weights and Laplacians (Appendix III)."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

__all__ = ["cotangent_laplacian", "mended_cotangents", "vertex_areas"]

_SLACK = 1e-3
"""A triangle whose longest edge is shorter than the two others together by less than this share of it
is a sliver. The cotangents of what is left stay below a thousand."""


_BLOCK = 16384
"""Faces that are worked on at once."""


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
    cotangents, slivers = _cotangents(vertices, np.ascontiguousarray(faces.T))
    return np.ascontiguousarray(cotangents.T), slivers


def _cotangents(
    vertices: NDArray[np.float64], corners: NDArray[np.integer[Any]]
) -> tuple[NDArray[np.float64], int]:
    """Compute the cotangents from the corners of the faces, both (3, m).

    Block by block: what lies between stays in the cache of the processor.
    """
    places = np.ascontiguousarray(vertices.T)
    cotangents = np.zeros(corners.shape)
    slivers = 0
    for begin in range(0, corners.shape[1], _BLOCK):
        block = slice(begin, begin + _BLOCK)
        cotangents[:, block], found = _mended(*_lengths(places, corners[:, block]))
        slivers += found
    return cotangents, slivers


def _mended(
    a: NDArray[np.float64], b: NDArray[np.float64], c: NDArray[np.float64]
) -> tuple[list[NDArray[np.float64]], int]:
    """Return the cotangents of triangles, by the lengths of their edges, and the number of slivers."""
    longest = np.maximum(np.maximum(a, b), c)
    missing = _SLACK * longest - ((a + b + c) - 2.0 * longest)
    slivers = np.flatnonzero(missing > 0.0)
    # Adding e to all three edges raises the slack by e and the wanted slack by _SLACK * e.
    for length in (a, b, c):
        length[slivers] += missing[slivers] / (1.0 - _SLACK)
    # Heron's formula in the order that keeps its factors accurate for thin triangles.
    four_area = np.sqrt((a + b + c) * (b + c - a) * (c + a - b) * (a + b - c))
    squared = [length**2 for length in (a, b, c)]
    total = squared[0] + squared[1] + squared[2]
    return [(total - 2.0 * own) / four_area for own in squared], len(slivers)


def _lengths(places: NDArray[np.float64], corners: NDArray[np.integer[Any]]) -> list[NDArray[np.float64]]:
    """Return the lengths of the edges opposite to each corner of the faces, (m,) each, column by column."""
    squares: list[NDArray[np.float64]] = []
    for axis in places:
        at = [axis[corner] for corner in corners]
        sides = [(at[2] - at[1]) ** 2, (at[0] - at[2]) ** 2, (at[1] - at[0]) ** 2]
        squares = [one + other for one, other in zip(squares, sides, strict=True)] if squares else sides
    return [np.sqrt(square) for square in squares]


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
    n = len(vertices)
    # 32-bit indices where they can hold the entries: half the memory, and faster.
    index = np.int32 if 9 * len(faces) + n < np.iinfo(np.int32).max else np.int64
    corners = np.ascontiguousarray(faces.T, dtype=index)
    cotangents, slivers = _cotangents(vertices, corners)
    if weights is not None:
        cotangents *= weights
    start, end = corners[[1, 2, 0]].ravel(), corners[[2, 0, 1]].ravel()
    weight = 0.5 * cotangents.ravel()
    degree = np.bincount(start, weights=weight, minlength=n) + np.bincount(end, weights=weight, minlength=n)
    # The upper triangle with half of the diagonal: with its transpose it is the whole.
    itself = np.arange(n, dtype=index)
    rows = np.concatenate([np.minimum(start, end), itself])
    columns = np.concatenate([np.maximum(start, end), itself])
    half = sp.coo_array((np.concatenate([-weight, 0.5 * degree]), (rows, columns)), shape=(n, n)).tocsr()
    return (half + half.T).tocsr(), slivers


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
    places, corners = np.ascontiguousarray(vertices.T), np.ascontiguousarray(faces.T)
    thirds = np.zeros(len(faces))
    for begin in range(0, len(faces), _BLOCK):
        block = slice(begin, begin + _BLOCK)
        (ux, uy, uz), (vx, vy, vz) = (
            places[:, corners[end, block]] - places[:, corners[0, block]] for end in (1, 2)
        )
        squared = (uy * vz - uz * vy) ** 2 + (uz * vx - ux * vz) ** 2 + (ux * vy - uy * vx) ** 2
        thirds[block] = np.sqrt(squared) / 6.0
    areas = np.zeros(len(vertices))
    for corner in corners:
        areas += np.bincount(corner, weights=thirds, minlength=len(vertices))
    return areas
