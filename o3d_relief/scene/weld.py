"""The welded copy of a mesh on which everything is solved, and the way back.

Files from game and GLB pipelines split every vertex at UV seams; solved as they come, they would fall
apart along each seam.
"""

from __future__ import annotations

from dataclasses import dataclass

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


def first_of_equal_rows(rows: NDArray[np.float64]) -> NDArray[np.int64]:
    """Find for each row of (n, c) the first one that equals it, (n,)."""
    order = np.lexsort(rows.T)  # stable: equal rows stay in input order
    ordered = rows[order]
    is_new = np.ones(len(rows), dtype=bool)
    is_new[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    first = order[is_new][np.cumsum(is_new) - 1]
    result = np.zeros(len(rows), dtype=np.int64)
    result[order] = first
    return result


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
    different = np.unique(np.sort(faces[_whole(faces)], axis=1), axis=0)
    edges = different[:, [[0, 1], [1, 2], [0, 2]]].reshape(-1, 2)
    _, first, count = np.unique(
        edges @ np.array([faces.max(initial=0) + 1, 1]), return_index=True, return_counts=True
    )
    return np.unique(edges[first[count == 1]])


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
    same = first_of_equal_rows(np.sort(candidates, axis=1).astype(np.float64))
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
