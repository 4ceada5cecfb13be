"""Vertices at one place, moved apart: files are read by position."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from o3d_relief.errors import MeshError
from o3d_relief.solid.body import Solid

__all__ = ["distinct"]

_STEPS = 8.0
"""By how many steps of float32 vertices at one place are moved, at first."""

_ONE_PLACE_MM = 1e-7
"""Vertices that are closer are at one place: near zero float32 tells 1e-10 mm from none, but programs that
join vertices do not."""

_FARTHEST_MM = 0.005
"""Farther than this nothing is moved."""


def distinct(solid: Solid) -> Solid:
    """Return the solid with no two vertices at one place, measured in float32 and to 1e-7 mm.

    Most programs read a file by position. Where parts of a solid touch in an edge, they would find edges
    with four faces, and start to repair. Vertices that lie at one place are moved towards the mean of their
    neighbours, which opens a gap between parts that touch, by as little as float32 can hold: less than a
    thousandth of a millimetre for most pieces. What lies in the back stays in it.

    Parameters
    ----------
    solid : Solid

    Returns
    -------
    Solid
        The same one where nothing has to be moved.

    Raises
    ------
    MeshError
        Moves of 0.005 mm are not enough.

    Examples
    --------
    >>> from o3d_relief.solid.body import manifold_of
    >>> v = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    >>> f = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    >>> tip = Solid.from_manifold(manifold_of(v, f, is_plate=False), colored=False)
    >>> distinct(tip) is tip
    True
    """
    spacing = float(np.spacing(np.float32(np.abs(solid.vertices).max())))
    vertices = np.array(solid.vertices)
    step = _STEPS * spacing
    back = vertices[:, 2].min()
    moved = False
    while True:
        crowded, rank = _crowded(vertices)
        if len(crowded) == 0:
            return replace(solid, vertices=vertices) if moved else solid
        if step > _FARTHEST_MM:
            raise MeshError(
                f"{len(crowded)} vertices of the solid lie closer together than files in float32 can hold: "
                "make it smaller, or write PLY."
            )
        direction = _to_neighbours(vertices, solid.faces, crowded)
        direction[vertices[crowded, 2] == back, 2] = 0.0
        length = np.linalg.norm(direction, axis=1, keepdims=True)
        # Each by another length: they may all have the same way to go.
        far = step * (1.0 + rank[:, None])
        vertices[crowded] += far * direction / np.where(length > 0.0, length, 1.0)
        step *= 2.0
        moved = True


def _crowded(vertices: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the vertices (c,) that share their place, in float32, with others, and their ranks."""
    rounded = vertices.astype(np.float32).astype(np.float64)
    pairs = cKDTree(rounded).query_pairs(_ONE_PLACE_MM, output_type="ndarray")
    if len(pairs) == 0:
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
    crowded, ends = np.unique(pairs, return_inverse=True)
    one, other = ends.reshape(pairs.shape).T
    graph = coo_array((np.ones(len(one)), (one, other)), shape=(len(crowded), len(crowded)))
    places = connected_components(graph, directed=False)[1]
    order = np.argsort(places, kind="stable")
    ordered = places[order]
    rank = np.zeros(len(crowded), dtype=np.int64)
    rank[order] = np.arange(len(crowded)) - np.searchsorted(ordered, ordered)
    return crowded.astype(np.int64), rank


def _to_neighbours(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], chosen: NDArray[np.int64]
) -> NDArray[np.float64]:
    """Return the way (c, 3) from each chosen vertex to the mean of its neighbours."""
    number = np.full(len(vertices), -1)
    number[chosen] = np.arange(len(chosen))
    around = faces[(number[faces] >= 0).any(axis=1)]
    total = np.zeros((len(chosen), 3))
    count = np.zeros(len(chosen))
    for corner in range(3):
        mine = number[around[:, corner]]
        here = mine >= 0
        for other in (1, 2):
            neighbour = vertices[around[here, (corner + other) % 3]]
            np.add.at(total, mine[here], neighbour - vertices[chosen[mine[here]]])
            np.add.at(count, mine[here], 1.0)
    return np.asarray(total / np.maximum(count, 1.0)[:, None])
