"""Surfaces stacked on the lines of a regular grid, found triangle by triangle."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from o3d_relief.bounds.lines import Lines
from o3d_relief.bounds.pairs import Pairs, next_to_each_other

__all__ = ["column_pairs"]

_NARROW = 0.01
"""Weights below minus this are those of slivers without an area, which are met by chance."""


def column_pairs(lines: Lines, *, side: int) -> Pairs:
    """Pair the points that follow each other on the lines of a regular grid, as `grid_pairs` does.

    No rays are cast: each triangle is asked which rows of the grid it meets, and on each row which lines.
    That takes half the time, or less, and the points are exact.

    Parameters
    ----------
    lines : Lines
        Of a mesh.
    side : int
        Number of lines along x and along y, in the middle of as many cells of the box of the vertices; at
        most 65,535.

    Returns
    -------
    Pairs
        Neighbours on the surface, which meet where the line passes, are left out.

    Examples
    --------
    Two triangles, one unit apart:

    >>> places = np.array([[0, 0, 0], [8, 0, 0], [0, 8, 0], [0, 0, 1], [8, 0, 1], [0, 8, 1.0]])
    >>> column_pairs(Lines(places, np.array([[0, 1, 2], [3, 4, 5]])), side=2).gap.tolist()
    [1.0]
    """
    if len(lines.faces) == 0:
        return Pairs.join([])
    corners = np.ascontiguousarray(lines.faces.T)
    # In steps of the grid its lines pass through the whole numbers.
    x, y = (_in_steps(np.ascontiguousarray(axis), side) for axis in lines.vertices[:, :2].T)
    triangle, row = _rows(x[corners], y[corners], side)
    triangle, row, column = _lines_on(x, y, corners, triangle, row, side)
    weights = _weights(x, y, corners, triangle, row, column)
    inside = weights.min(axis=1, initial=0.0) >= -_NARROW
    met = np.flatnonzero(inside & ~lines.borders.grazed(triangle, weights))
    triangle, weights = triangle[met], weights.take(met, axis=0)
    heights = np.ascontiguousarray(lines.vertices[:, 2])
    point = lines.faces.take(triangle, axis=0)
    order, line = _along_lines(row[met], column[met], np.einsum("qc,qc->q", heights[point], weights))
    following = np.flatnonzero(line[1:] == line[:-1])
    below, above = order[following], order[following + 1]
    return next_to_each_other(
        heights,
        point.take(above, axis=0),
        weights.take(above, axis=0),
        point.take(below, axis=0),
        weights.take(below, axis=0),
    )


def _in_steps(places: NDArray[np.float64], side: int) -> NDArray[np.float64]:
    """Return places along one axis, counted in steps of the grid."""
    low, high = float(places.min()), float(places.max())
    return np.asarray((places - low) * (side / max(high - low, 1e-30)) - 0.5)


def _rows(
    x: NDArray[np.float64], y: NDArray[np.float64], side: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return which triangles, of corners (3, m), meet which rows: of those whose box meets a line."""
    (left, right), (first, last) = (
        (np.ceil(np.minimum(np.minimum(a, b), c)), np.floor(np.maximum(np.maximum(a, b), c)))
        for a, b, c in (x, y)
    )
    some = np.flatnonzero((left <= right) & (first <= last))
    return _counted(some, np.maximum(first[some], 0.0), np.minimum(last[some], side - 1.0))


def _counted(
    item: NDArray[np.int64], first: NDArray[np.float64], last: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return each item once for each whole number from its first to its last, and the number."""
    start = first.astype(np.int64)
    count = np.maximum(last.astype(np.int64) - start + 1, 0)
    start -= np.cumsum(count) - count
    return np.repeat(item, count), np.repeat(start, count) + np.arange(int(count.sum()))


def _lines_on(
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    corners: NDArray[np.int64],
    triangle: NDArray[np.int64],
    row: NDArray[np.int64],
    side: int,
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Return which triangles meet which lines of their rows: triangle, row and column."""
    left, right = np.full(len(row), float(side)), np.full(len(row), -1.0)
    above = [y[corner[triangle]] - row for corner in corners]
    along = [x[corner[triangle]] for corner in corners]
    for start, end in ((0, 1), (1, 2), (2, 0)):
        rise = above[start] - above[end]
        level = rise == 0.0  # both ends are ends of other sides, too
        rise[level] = 1.0
        place = along[start] + above[start] / rise * (along[end] - along[start])
        place[level | (above[start] * above[end] > 0.0)] = np.nan
        left, right = np.fmin(left, place), np.fmax(right, place)
    number, column = _counted(
        np.arange(len(row)), np.maximum(np.ceil(left), 0.0), np.minimum(np.floor(right), side - 1.0)
    )
    return triangle[number], row[number], column


def _weights(
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    corners: NDArray[np.int64],
    triangle: NDArray[np.int64],
    row: NDArray[np.int64],
    column: NDArray[np.int64],
) -> NDArray[np.float64]:
    """Return the barycentric coordinates (q, 3) at which lines meet triangles; -1 where they have no area."""
    across = [x[corner[triangle]] - column for corner in corners]
    up = [y[corner[triangle]] - row for corner in corners]
    weights = np.stack([across[i - 2] * up[i - 1] - across[i - 1] * up[i - 2] for i in range(3)])
    area = weights.sum(axis=0)
    weights = np.where(area == 0.0, -1.0, weights / np.where(area == 0.0, 1.0, area))
    return np.ascontiguousarray(weights.T)


def _along_lines(
    row: NDArray[np.int64], column: NDArray[np.int64], height: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Sort points by line and by height on it; return their order, and the line of each in this order."""
    order = np.argsort(column.astype(np.uint16), kind="stable")
    order = order[np.argsort(row[order].astype(np.uint16), kind="stable")]
    line = (row * (int(column.max(initial=0)) + 1) + column)[order]
    low, high = height.min(initial=0.0), height.max(initial=0.0)
    # A sort of what is sorted by line already is fast; float64 has room for line and height.
    within = np.argsort(line + (height[order] - low) / (2.0 * max(high - low, 1e-30)), kind="stable")
    return order[within], line
