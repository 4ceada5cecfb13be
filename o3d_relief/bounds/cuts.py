"""Edges that the trim makes across triangles that stand upright."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from o3d_relief.bounds.crossings import cross
from o3d_relief.bounds.new_crossings import new_crossings
from o3d_relief.bounds.pairs import Pairs
from o3d_relief.bounds.raster import Raster

__all__ = ["cut_crossings"]

_NARROW = 2e-3
"""Width in the picture, in relief units, below which nothing is seen to pierce a triangle."""


def cut_crossings(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    raster: Raster,
    z: NDArray[np.float64],
    *,
    among: NDArray[np.bool_] | None = None,
) -> tuple[Pairs, int]:
    """Find where the new edges of trimmed triangles would pierce others, and did not before.

    The trim leaves a quadrangle of a triangle with one corner behind S, and cuts it from its highest corner.
    In a triangle that is a line in the picture no other edge need pierce what this diagonal pierces: where
    the border of a plate enters it from which it hangs, nothing tells.

    Parameters
    ----------
    vertices : (n, 3) float64
        Before.
    faces : (m, 3) int64
    raster : Raster
        Of the faces.
    z : (n,) float64
        Heights now.
    among : (m,) bool, optional
        The triangles whose diagonals are looked at, without it all.

    Returns
    -------
    pairs : Pairs
        As `new_crossings` returns them.
    count : int
        Number of crossings.
    """
    # Two corners in front of S, one behind.
    side = np.where(z > 0.0, 1, np.where(z < 0.0, -5, 0)).astype(np.int8)
    cut = np.arange(len(faces)) if among is None else np.flatnonzero(among)
    one, two, three = side[faces[cut]].T
    cut = cut[one + two + three == -3]
    cut = cut[_narrow(vertices[:, :2], faces[cut])]
    if len(cut) == 0:
        return Pairs.join([]), 0
    changed = np.zeros(len(faces), dtype=bool)
    changed[cut] = True
    standing, faces = faces[cut], faces[raster.over_or_under(changed)]
    # From the highest corner to where S cuts the side opposite to it, the lower of two of one height first.
    back, front, tip = np.take_along_axis(standing, np.lexsort((-standing, z[standing]), axis=1), axis=1).T
    n = len(vertices)
    share = z[front] / (z[front] - z[back])
    foot = vertices[front] + share[:, None] * (vertices[back] - vertices[front])
    diagonals = np.stack([tip, n + np.arange(len(tip))], axis=1)
    moved = np.append(z, np.zeros(len(tip)))
    pairs, count = new_crossings(np.concatenate([vertices, foot]), faces, diagonals, moved)
    upper = _on_triangles(pairs.upper, pairs.upper_weights, front, back, share, n)
    lower = _on_triangles(pairs.lower, pairs.lower_weights, front, back, share, n)
    return Pairs(
        upper=upper[0], upper_weights=upper[1], lower=lower[0], lower_weights=lower[1], gap=pairs.gap
    ), count


def _narrow(plane: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Find the triangles that are lines in the picture."""
    a, b, c = plane[faces].transpose(1, 0, 2)
    longest = np.max([np.abs(side).max(axis=1) for side in (b - a, c - b, a - c)], axis=0)
    return np.asarray(np.abs(cross(b - a, c - a)) <= _NARROW * longest)


def _on_triangles(
    corners: NDArray[np.int64],
    weights: NDArray[np.float64],
    front: NDArray[np.int64],
    back: NDArray[np.int64],
    share: NDArray[np.float64],
    n: int,
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Write points of diagonals, (p, 3) corners and weights, as points of the triangles they cut."""
    corners, weights = corners.copy(), weights.copy()
    made = np.flatnonzero(corners[:, 1] >= n)
    number, at_foot = corners[made, 1] - n, weights[made, 1]
    corners[made, 1], corners[made, 2] = front[number], back[number]
    weights[made, 1], weights[made, 2] = (1.0 - share[number]) * at_foot, share[number] * at_foot
    return corners, weights
