"""Where the parts of a scene touch."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from o3d_relief.bounds.lines import weights_of
from o3d_relief.bounds.pairs import Pairs, as_points
from o3d_relief.rays import UnitBox

__all__ = ["touching_pairs"]


def touching_pairs(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], label: NDArray[np.int32], reach: float
) -> Pairs:
    """Pair each vertex with the surfaces of other parts that lie within reach along x, y or z.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int64
    label : (n,) int
        The part of each vertex.
    reach : float
        In relief units.

    Returns
    -------
    Pairs
        The vertices above, whichever way the other surface lies; the gap counts along the axis.
    """
    box = UnitBox(vertices, faces)
    candidates = _near_other_parts(vertices, label, reach)
    found = []
    middle = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
    for axis in np.eye(3):
        # Lists hold all that a ray meets: it comes from the middle, and so leaves the scene soon.
        outwards = vertices[candidates] @ axis > middle @ axis
        for direction, some in ((axis, candidates[outwards]), (-axis, candidates[~outwards])):
            if len(some):  # Open3D dies of a list without rays
                found.append(_within_reach(box, vertices, faces, label, some, direction, reach))
    return Pairs.join(found)


def _within_reach(
    box: UnitBox,
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    label: NDArray[np.int32],
    candidates: NDArray[np.int64],
    direction: NDArray[np.float64],
    reach: float,
) -> Pairs:
    """Pair some vertices with the surfaces of other parts within reach along one direction and against it."""
    hits = box.scene.list_intersections(box.rays(vertices[candidates] - reach * direction, direction))
    off = hits["t_hit"].numpy().astype(np.float64) * box.size - reach
    near = np.flatnonzero(np.abs(off) <= reach)
    vertex = candidates[hits["ray_ids"].numpy()[near].astype(np.int64)]
    other = faces[hits["primitive_ids"].numpy()[near].astype(np.int64)]
    elsewhere = label[vertex] != label[other[:, 0]]
    near, own = near[elsewhere], as_points(vertex[elsewhere])
    return Pairs(
        upper=own[0],
        upper_weights=own[1],
        lower=other[elsewhere],
        lower_weights=weights_of(hits["primitive_uvs"].numpy()[near]),
        gap=np.abs(off[near]),
    )


def _near_other_parts(
    vertices: NDArray[np.float64], label: NDArray[np.int32], reach: float
) -> NDArray[np.int64]:
    """Return the vertices that may touch another part: not those of the largest part far from all others."""
    largest = np.bincount(label).argmax()
    others = np.flatnonzero(label != largest)
    own = np.flatnonzero(label == largest)
    if len(others) == 0:
        return others
    low = np.full((label.max() + 1, 3), np.inf)
    high = np.full((label.max() + 1, 3), -np.inf)
    np.minimum.at(low, label[others], vertices[others])
    np.maximum.at(high, label[others], vertices[others])
    part = np.unique(label[others])
    centre, half = (low[part] + high[part]) / 2, (high[part] - low[part]) / 2
    around = cKDTree(vertices[own]).query_ball_point(centre, np.linalg.norm(half, axis=1) + 2.0 * reach)
    near = np.zeros(len(own), dtype=bool)
    for members in around:
        near[members] = True
    return np.sort(np.concatenate([others, own[near]]))
