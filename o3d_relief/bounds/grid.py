"""Surfaces stacked on the lines of a regular grid."""

from __future__ import annotations

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from o3d_relief.bounds.lines import UP, Lines, UnitBox, weights_of
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
    box, vertices, faces = lines.box, lines.vertices, lines.faces
    low = vertices.min(axis=0) if low is None else low
    high = vertices.max(axis=0) if high is None else high
    steps = (np.arange(side) + 0.5) / side
    x, y = (low[axis] + steps * (high[axis] - low[axis]) for axis in (0, 1))
    hits = box.scene.list_intersections(_grid_rays(box, x, y, vertices[:, 2].min() - 0.01 * box.size))
    triangle = hits["primitive_ids"].numpy().astype(np.int64)
    weights = weights_of(hits["primitive_uvs"].numpy())
    usable = np.flatnonzero(~lines.borders.grazed(triangle, weights))
    triangle, weights = triangle.take(usable), weights.take(usable, axis=0)
    line = hits["ray_ids"].numpy()[usable].astype(np.int64)
    t = hits["t_hit"].numpy()[usable].astype(np.float64)
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


def _grid_rays(
    box: UnitBox, x: NDArray[np.float64], y: NDArray[np.float64], height: float
) -> o3d.core.Tensor:
    """Return the rays upwards from a height at all of x and y, x first."""
    rays = np.zeros((len(y), len(x), 6), dtype=np.float32)
    rays[:, :, 0] = (x - box.middle[0]) / box.size
    rays[:, :, 1] = ((y - box.middle[1]) / box.size)[:, None]
    rays[:, :, 2] = (height - box.middle[2]) / box.size
    rays[:, :, 3:] = UP
    return o3d.core.Tensor(rays.reshape(-1, 6))


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
