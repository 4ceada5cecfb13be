"""Surfaces stacked on the lines of a regular grid."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from o3d_relief.bounds.lines import UP, Lines
from o3d_relief.bounds.pairs import Pairs, next_to_each_other

__all__ = ["grid_pairs"]

_NARROW = 0.01
"""Change of weights up to which points are moved onto their lines."""


def grid_pairs(
    lines: Lines,
    *,
    side: int = 1024,
    low: NDArray[np.float64] | None = None,
    high: NDArray[np.float64] | None = None,
    before: NDArray[np.float64] | None = None,
) -> Pairs:
    """Pair the points that follow each other on the lines of a regular grid.

    Parameters
    ----------
    lines : Lines
        Of a mesh.
    side : int
        Number of lines along x and along y.
    low, high : (3,) float64, optional
        Corners of the box that the grid covers, that of the vertices where omitted.
    before : (n,) float64, optional
        Other heights: pairs of triangles of which these say, too, that the upper one is above are left out.

    Returns
    -------
    Pairs
        Neighbours on the surface, which meet where the line passes, are left out. The gap of surfaces that
        touch is known to a rounding error only, and may be a little less than 0.
    """
    if len(lines.faces) == 0:
        return Pairs.join([])
    vertices, faces = lines.vertices, lines.faces
    low = vertices.min(axis=0) if low is None else low
    high = vertices.max(axis=0) if high is None else high
    steps = (np.arange(side) + 0.5) / side
    x, y = (low[axis] + steps * (high[axis] - low[axis]) for axis in (0, 1))
    start = np.empty((side, side, 3))
    start[:, :, 0], start[:, :, 1] = x, y[:, None]
    start[:, :, 2] = vertices[:, 2].min() - 0.01 * lines.size
    hits = lines.all(start.reshape(-1, 3), UP)
    hits = hits.select(np.flatnonzero(~lines.borders.grazed(hits.triangle, hits.weights)))
    triangle, weights, line, t = hits.triangle, hits.weights, hits.ray, hits.distance / lines.size
    # One sort by line and height on it: t is well below the factor's size, and float64 has room for both.
    order = np.argsort(line + t / (4.0 * max(float(t.max(initial=0.0)), 1.0)), kind="stable")
    following = np.flatnonzero(line[order][1:] == line[order][:-1])
    if before is not None:
        following = following[
            _may_turn(before[faces], triangle[order[following]], triangle[order[following + 1]])
        ]
    lower, upper = (
        _on_line(
            vertices,
            faces.take(triangle[chosen], axis=0),
            weights.take(chosen, axis=0),
            x[line[chosen] % side],
            y[line[chosen] // side],
        )
        for chosen in (order[following], order[following + 1])
    )
    return next_to_each_other(vertices[:, 2], *upper, *lower)


def _may_turn(
    heights: NDArray[np.float64], lower: NDArray[np.int64], upper: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Tell which triangles, (q,), are not wholly above others, for the heights of all corners (l, 3)."""
    least, most = heights.min(axis=1), heights.max(axis=1)
    beyond = 2.0 * _NARROW * (most - least)  # points may be that far beside their triangles
    return np.asarray((least - beyond)[upper] < (most + beyond)[lower])


def _on_line(
    vertices: NDArray[np.float64],
    corners: NDArray[np.int64],
    weights: NDArray[np.float64],
    *line: NDArray[np.float64],
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return points of triangles, (q, 3) corners and weights, put onto their lines, (q,) x and y, exactly.

    Rays in float32 miss them by a little, which is much in z where a triangle is steep. Of those that are so
    narrow that the line passes beside them, the weights stay.
    """
    x, y = (np.ascontiguousarray(vertices[:, axis])[corners.T] - line[axis] for axis in (0, 1))
    exact = np.stack([x[i - 2] * y[i - 1] - x[i - 1] * y[i - 2] for i in range(3)], axis=1)
    area = exact.sum(axis=1, keepdims=True)
    exact /= np.where(area == 0.0, 1.0, area)
    beside = (area[:, 0] == 0.0) | (np.abs(exact - weights).max(axis=1) > _NARROW)
    return corners, np.where(beside[:, None], weights, exact)
