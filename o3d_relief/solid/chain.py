"""Meshes as chains: what is missing to a closed surface, whatever the mesh.

Sum the directed edges of all faces, those in opposite directions against each other: what remains is the
boundary of the mesh. It enters each vertex as often as it leaves it, so it falls into loops; a mesh
without boundary encloses a volume, and manifold3d takes it, whether edges join two faces or four.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from o3d_relief.scene.weld import first_of_equal_rows

__all__ = [
    "bodies",
    "boundary",
    "edge_components",
    "loops",
    "one_of_each",
    "separate_parts",
    "volume",
    "without_opposites",
]


def one_of_each(faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """Leave out faces on the same three vertices as one before, whichever way they turn.

    Parameters
    ----------
    faces : (m, 3) int64

    Returns
    -------
    (q,) int64
        Rows of `faces` that stay.
    """
    first = first_of_equal_rows(np.sort(faces, axis=1))
    return np.flatnonzero(first == np.arange(len(faces)))


def without_opposites(faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """Leave out pairs of faces on the same three vertices that turn against each other, and duplicates.

    Parameters
    ----------
    faces : (m, 3) int64

    Returns
    -------
    (q,) int64
        Rows of `faces` that stay: one for each three vertices whose faces do not cancel.

    Examples
    --------
    >>> without_opposites(np.array([[0, 1, 2], [3, 4, 5], [2, 1, 0], [4, 5, 3]])).tolist()
    [1]
    """
    first = first_of_equal_rows(np.sort(faces, axis=1))
    a, b, c = faces.T
    turn = np.where((a < b) ^ (b < c) ^ (c < a), 1, -1)
    net = np.bincount(first, weights=turn, minlength=len(faces))
    # Of what is left, the first that turns the way the sum does.
    stays = np.flatnonzero(net[first] * turn > 0)
    _, where = np.unique(first[stays], return_index=True)
    return np.asarray(stays[np.sort(where)])


def edge_components(faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """Find the parts of a mesh: what hangs together over edges.

    Parameters
    ----------
    faces : (m, 3) int64

    Returns
    -------
    (m,) int64
        Part of each face, numbered from 0 in the order of their first faces.
    """
    _, edge = _edges(faces)
    count = len(faces)
    face = np.repeat(np.arange(count), 3)
    size = count + int(edge.max(initial=-1)) + 1
    graph = coo_matrix((np.ones(len(edge)), (face, count + edge)), shape=(size, size))
    label = connected_components(graph, directed=False)[1][:count]
    _, first, inverse = np.unique(label, return_index=True, return_inverse=True)
    return np.asarray(np.argsort(np.argsort(first))[inverse])


def separate_parts(faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """Find the parts of a mesh, and take those apart that only touch.

    What hangs together over edges of two faces and has no boundary by itself is a part, even where more faces
    meet at some of its edges: two boxes that share an edge are two parts.

    Parameters
    ----------
    faces : (m, 3) int64

    Returns
    -------
    (m,) int64
        Part of each face, numbered from 0 in the order of their first faces.
    """
    directed, edge = _edges(faces)
    face = np.repeat(np.arange(len(faces)), 3)
    plain = np.bincount(edge)[edge] == 2
    size = len(faces) + int(edge.max(initial=-1)) + 1
    graph = coo_matrix((plain.astype(np.float64), (face, len(faces) + edge)), shape=(size, size))
    graph.eliminate_zeros()
    patch = connected_components(graph, directed=False)[1][: len(faces)]
    side = edge * (int(patch.max(initial=0)) + 1) + patch[face]
    _, place, inverse = np.unique(side, return_index=True, return_inverse=True)
    net = np.bincount(inverse.reshape(-1), weights=np.where(directed[:, 0] < directed[:, 1], 1, -1))
    is_open = np.zeros(int(patch.max(initial=0)) + 1, dtype=bool)
    is_open[patch[face[place[net != 0.0]]]] = True
    rest = np.flatnonzero(is_open[patch])
    label = patch.astype(np.int64)
    label[rest] = edge_components(faces[rest]) + len(is_open)
    _, first, inverse = np.unique(label, return_index=True, return_inverse=True)
    return np.asarray(np.argsort(np.argsort(first))[inverse])


def bodies(faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """Find what hangs together over vertices.

    Parameters
    ----------
    faces : (m, 3) int64

    Returns
    -------
    (m,) int64
        Body of each face, numbered from 0.

    Examples
    --------
    >>> bodies(np.array([[0, 1, 2], [3, 4, 5], [2, 6, 7]])).tolist()
    [0, 1, 0]
    """
    a, b, c = faces.T
    count = int(faces.max()) + 1
    graph = coo_matrix(
        (np.ones(2 * len(a)), (np.concatenate([a, b]), np.concatenate([b, c]))), shape=(count, count)
    )
    _, body = np.unique(connected_components(graph, directed=False)[1][a], return_inverse=True)
    return np.asarray(body)


def boundary(faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """Find the directed edges that no face runs along in the other direction.

    Parameters
    ----------
    faces : (m, 3) int64

    Returns
    -------
    (b, 2) int64
        In the direction of their faces, several times where several faces have no counterpart.

    Examples
    --------
    >>> boundary(np.array([[0, 1, 2], [2, 1, 3]])).tolist()
    [[0, 1], [2, 0], [1, 3], [3, 2]]
    """
    directed, edge = _edges(faces)
    sign = np.where(directed[:, 0] < directed[:, 1], 1, -1)
    net = np.bincount(edge, weights=sign).astype(np.int64)
    first = np.zeros(len(net), dtype=np.int64)
    # The first edge that runs the way the sum does stands for all of them.
    rows = np.flatnonzero(net[edge] * sign > 0)
    first[edge[rows][::-1]] = rows[::-1]
    open_edges = np.flatnonzero(net)
    order = np.argsort(first[open_edges], kind="stable")
    open_edges = open_edges[order]
    return np.asarray(np.repeat(directed[first[open_edges]], np.abs(net[open_edges]), axis=0))


def loops(edges: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    """Walk along a boundary.

    Parameters
    ----------
    edges : (b, 2) int64
        Each vertex is entered as often as it is left.

    Returns
    -------
    list of (l,) int64
        Vertices of each loop in the direction of its edges.

    Examples
    --------
    >>> [loop.tolist() for loop in loops(np.array([[0, 1], [2, 0], [1, 2]]))]
    [[0, 1, 2]]
    """
    by_start = np.argsort(edges[:, 0], kind="stable")
    by_end = np.argsort(edges[:, 1], kind="stable")
    following = np.zeros(len(edges), dtype=np.int64)
    following[by_end] = by_start
    following_of, start = following.tolist(), edges[:, 0]
    seen = [False] * len(edges)
    result = []
    for edge in range(len(edges)):
        walk = []
        current = edge
        while not seen[current]:
            seen[current] = True
            walk.append(current)
            current = following_of[current]
        if walk:
            result.append(start[walk])
    return result


def volume(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> float:
    """Return the volume that a mesh without boundary encloses, negative where it is inside out."""
    a, b, c = (vertices - vertices[faces[0, 0]])[faces].transpose(1, 0, 2)
    return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6.0


def _edges(faces: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the directed edges (3m, 2) of all faces, and the number of the undirected edge of each."""
    directed = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)
    low, high = directed.min(axis=1), directed.max(axis=1)
    _, edge = np.unique(low * (high.max(initial=0) + 1) + high, return_inverse=True)
    return directed, edge.reshape(-1)
