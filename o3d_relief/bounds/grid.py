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
    x, y = np.meshgrid(low[0] + steps * (high[0] - low[0]), low[1] + steps * (high[1] - low[1]))
    start = np.stack(
        [x.ravel(), y.ravel(), np.full(side * side, vertices[:, 2].min() - 0.01 * lines.size)], axis=1
    )
    hits = lines.all(start, UP)
    hits = hits.select(np.flatnonzero(~lines.borders.grazed(hits.triangle, hits.weights)))
    triangle, weights, line, t = hits.triangle, hits.weights, hits.ray, hits.distance / lines.size
    # One sort by line and height on it: t is well below the factor's size, and float64 has room for both.
    order = np.argsort(line + t / (4.0 * max(float(t.max(initial=0.0)), 1.0)), kind="stable")
    following = np.flatnonzero(line[order][1:] == line[order][:-1])
    lower, upper = (
        _on_line(vertices, faces[triangle[chosen]], weights[chosen], start[line[chosen], :2])
        for chosen in (order[following], order[following + 1])
    )
    return next_to_each_other(vertices[:, 2], *upper, *lower)


def _on_line(
    vertices: NDArray[np.float64],
    corners: NDArray[np.int64],
    weights: NDArray[np.float64],
    line: NDArray[np.float64],
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return points of triangles, (q, 3) corners and weights, put onto their lines (q, 2) exactly.

    Rays in float32 miss them by a little, which is much in z where a triangle is steep. Of those that are so
    narrow that the line passes beside them, the weights stay.
    """
    x, y = (np.ascontiguousarray(vertices[:, axis])[corners.T] - line[:, axis] for axis in (0, 1))
    exact = np.stack([x[i - 2] * y[i - 1] - x[i - 1] * y[i - 2] for i in range(3)], axis=1)
    area = exact.sum(axis=1, keepdims=True)
    exact /= np.where(area == 0.0, 1.0, area)
    beside = (area[:, 0] == 0.0) | (np.abs(exact - weights).max(axis=1) > _NARROW)
    return corners, np.where(beside[:, None], weights, exact)
