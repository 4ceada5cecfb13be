"""The welded copy of a mesh on which everything is solved, and the way back.

Files from game and GLB pipelines split every vertex at UV seams; solved as they come, they would fall
apart along each seam.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

__all__ = ["SEAM", "Welded", "first_of_equal_rows", "same_places", "weld"]

SEAM = 1e-3
"""Open edges closer than this, in relief units (1e-5 of the extent), belong together.

The two sides of a seam often differ by rounding errors, of float32 or of a text with six digits.
"""


_MIXERS = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], dtype=np.uint64)
"""Odd factors without a pattern, for checksums of rows of three."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Welded:
    """A mesh without coincident vertices, degenerate or duplicate faces, or unreferenced vertices.

    Attributes
    ----------
    vertices : (n, 3) float64
        In the order of the input.
    faces : (m, 3) int64
    index : (n_in,) int64
        Welded vertex of each input vertex, -1 where no kept face uses it.
    face_from : (m,) int64
        Input face of each face.
    face_index : (m_in,) int64
        Welded face of each input face, -1 for a degenerate one.
    merged_vertices, unreferenced_vertices, degenerate_faces, duplicate_faces : int
        What was set aside.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    index: NDArray[np.int64]
    face_from: NDArray[np.int64]
    face_index: NDArray[np.int64]
    merged_vertices: int
    unreferenced_vertices: int
    degenerate_faces: int
    duplicate_faces: int


def first_of_equal_rows(rows: NDArray[Any]) -> NDArray[np.int64]:
    """Find for each row of (n, c) the first one that equals it, (n,).

    Rows are compared by a checksum first: only those that share theirs with another one need a sort.
    """
    itself = np.arange(len(rows))
    # Adding zero makes zeros of both signs the same bits.
    bits = np.ascontiguousarray(rows + rows.dtype.type(0)).view(np.uint64)
    checksum = bits @ _MIXERS[: bits.shape[1]]
    ordered = np.sort(checksum)
    shared = ordered[1:][ordered[1:] == ordered[:-1]]
    if len(shared) == 0:
        return itself
    place = np.minimum(np.searchsorted(shared, checksum), len(shared) - 1)
    some = np.flatnonzero(shared[place] == checksum)
    among = rows[some]
    order = np.lexsort(among.T)  # stable: equal rows stay in input order
    is_new = np.ones(len(some), dtype=bool)
    is_new[1:] = (among[order[1:]] != among[order[:-1]]).any(axis=1)
    first = order[is_new][np.cumsum(is_new) - 1]
    itself[some[order]] = some[first]
    return itself


def _whole(faces: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Tell which faces have three different corners, (m,)."""
    a, b, c = faces.T
    return np.asarray((a != b) & (b != c) & (c != a))


def same_places(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], tolerance: float = SEAM
) -> NDArray[np.int64]:
    """Find for each vertex the one that stands for all vertices at its place.

    Equal vertices are at one place; so are those at open edges that are nearly equal. Nothing else is
    merged, however fine a mesh is.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int64
    tolerance : float
        Largest distance between two sides of a seam, in the unit of the vertices.

    Returns
    -------
    (n,) int64
        The first of equal vertices; across a seam, that of the smallest coordinates, x before y before z.

    Examples
    --------
    >>> v = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1e-7, 0], [0, 1, 0], [1, 1, 0.0]])
    >>> same_places(v, np.array([[0, 1, 2], [3, 5, 4]])).tolist()
    [0, 1, 2, 1, 2, 5]
    """
    first = first_of_equal_rows(vertices)
    rim = _rim(first[faces])
    near = cKDTree(vertices[rim]).query_pairs(tolerance, output_type="ndarray")
    if len(near) == 0:
        return first
    graph = sp.coo_array((np.ones(len(near)), (near[:, 0], near[:, 1])), shape=(len(rim), len(rim)))
    _, group = connected_components(graph, directed=False)
    order = np.lexsort((*vertices[rim].T[::-1], group))
    _, smallest = np.unique(group[order], return_index=True)
    stands_for = np.arange(len(vertices))
    stands_for[rim] = rim[order[smallest]][group]
    return np.asarray(stands_for[first])


def _rim(faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the vertices of edges that only one face has."""
    different = _sorted_corners(faces[_whole(faces)])
    different = different[_is_first(different)]
    n = int(faces.max(initial=0)) + 1
    low, middle, high = different.T
    edges = np.sort(np.concatenate([low * n + middle, middle * n + high, low * n + high]))
    same = edges[1:] == edges[:-1]
    alone = np.ones(len(edges), dtype=bool)
    alone[1:] &= ~same
    alone[:-1] &= ~same
    single = edges[alone]
    rim = np.zeros(n, dtype=bool)
    rim[single // n] = True
    rim[single % n] = True
    return np.flatnonzero(rim)


def _sorted_corners(faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the corners of each face in rising order, (m, 3)."""
    a, b, c = faces.T
    low, high = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
    return np.stack([low, a + b + c - low - high, high], axis=1)


def _is_first(rows: NDArray[np.int64]) -> NDArray[np.bool_]:
    return np.asarray(first_of_equal_rows(rows) == np.arange(len(rows)))


def weld(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> Welded:
    """Merge coincident vertices and set aside what has no area or no use.

    Parameters
    ----------
    vertices : (n_in, 3) float64
        In relief units. Vertices are coincident where `same_places` says so.
    faces : (m_in, 3) int64
        Two faces on the same three vertices are duplicates, whichever way they turn; the first stays.

    Returns
    -------
    Welded
        With no faces left where every face is degenerate.

    Examples
    --------
    >>> v = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.0]])
    >>> weld(v, np.array([[0, 1, 2], [3, 5, 4]])).index.tolist()
    [0, 1, 2, 1, 2, 3]
    """
    stands_for = same_places(vertices, faces)
    merged = stands_for[faces]
    whole = _whole(merged)
    candidates = merged[whole]
    same = first_of_equal_rows(_sorted_corners(candidates))
    is_first = same == np.arange(len(same))
    kept = candidates[is_first]
    used = np.zeros(len(vertices), dtype=bool)
    used[kept] = True
    number = np.where(used, np.cumsum(used) - 1, -1)
    index = number[stands_for]
    face_index = np.full(len(faces), -1, dtype=np.int64)
    face_index[whole] = (np.cumsum(is_first) - 1)[same]
    return Welded(
        vertices=vertices[used],
        faces=number[kept],
        index=index,
        face_from=np.flatnonzero(whole)[is_first],
        face_index=face_index,
        merged_vertices=int((stands_for != np.arange(len(stands_for))).sum()),
        unreferenced_vertices=int((index < 0).sum()),
        degenerate_faces=int((~whole).sum()),
        duplicate_faces=len(candidates) - len(kept),
    )
