"""The welded copy of a mesh on which everything is solved, and the way back.

Files from game and GLB pipelines split every vertex at UV seams; solved as they come, they would fall
apart along each seam.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Welded", "first_of_equal_rows", "weld"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Welded:
    """A mesh without coincident vertices, degenerate or duplicate faces, or unreferenced vertices.

    Attributes
    ----------
    vertices : (n, 3) float64
        In the order of their first occurrence in the input.
    faces : (m, 3) int64
    index : (n_in,) int64
        Welded vertex of each input vertex, -1 where no kept face uses it.
    face_from : (m,) int64
        Input face of each face.
    merged_vertices, unreferenced_vertices, degenerate_faces, duplicate_faces : int
        What was set aside.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    index: NDArray[np.int64]
    face_from: NDArray[np.int64]
    merged_vertices: int
    unreferenced_vertices: int
    degenerate_faces: int
    duplicate_faces: int


def first_of_equal_rows(rows: NDArray[np.float64]) -> NDArray[np.int64]:
    """Find for each row the first one that equals it.

    Parameters
    ----------
    rows : (n, c) float64

    Returns
    -------
    (n,) int64
        Its own number for a row that equals none before it.
    """
    order = np.lexsort(rows.T)  # stable: equal rows stay in input order
    ordered = rows[order]
    is_new = np.ones(len(rows), dtype=bool)
    is_new[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    first = order[is_new][np.cumsum(is_new) - 1]
    result = np.zeros(len(rows), dtype=np.int64)
    result[order] = first
    return result


def weld(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> Welded:
    """Merge coincident vertices and set aside what has no area or no use.

    Parameters
    ----------
    vertices : (n_in, 3) float64
        Vertices are coincident where all three coordinates are equal.
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
    first = first_of_equal_rows(vertices)
    merged = first[faces]
    a, b, c = merged.T
    whole = (a != b) & (b != c) & (c != a)
    candidates = merged[whole]
    same = first_of_equal_rows(np.sort(candidates, axis=1).astype(np.float64))
    first_time = same == np.arange(len(same))
    kept = candidates[first_time]
    used = np.zeros(len(vertices), dtype=bool)
    used[kept] = True
    number = np.where(used, np.cumsum(used) - 1, -1)
    index = number[first]
    return Welded(
        vertices=vertices[used],
        faces=number[kept],
        index=index,
        face_from=np.flatnonzero(whole)[first_time],
        merged_vertices=int((first != np.arange(len(first))).sum()),
        unreferenced_vertices=int((index < 0).sum()),
        degenerate_faces=int((~whole).sum()),
        duplicate_faces=len(candidates) - len(kept),
    )
