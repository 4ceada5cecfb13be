"""How low the visible surface may come to lie in front of S."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates, minimum_filter, uniform_filter

__all__ = ["lowest_heights"]

_CELL = 0.5
_REACH = 2
"""Cells to each side over which the lowest visible height is sought; those around a place, whose mean is
taken, are within one less."""

_HIGHEST = 2.0
"""Relief units above what is lowest around, one unit to each side, from which on a surface is no longer steep
but stands before another one: what is kept must not grow with the distance to that, at the outline alone."""


def lowest_heights(
    vertices: NDArray[np.float64], visible: NDArray[np.bool_], *, share: float
) -> NDArray[np.float64]:
    """Return how low each visible vertex may come to lie.

    A surface pressed flat onto S looks cut off: where it has to stay in front of S, it keeps a share of its
    height above the lowest visible point around it, as far as that is local: at most of two relief units.

    Parameters
    ----------
    vertices : (n, 3) float64
        Original positions in relief units.
    visible : (n,) bool
    share : float
        0 for the plane S itself.

    Returns
    -------
    (n,) float64
        At least 0 for what is visible, minus infinity for the rest.
    """
    seen = vertices[visible]
    low = seen[:, :2].min(axis=0) - 0.5 * _CELL
    place = (seen[:, :2] - low) / _CELL - 0.5
    cell = np.rint(place).astype(np.int64)
    lowest = np.full(cell.max(axis=0) + 1, np.inf)
    np.minimum.at(lowest, (cell[:, 0], cell[:, 1]), seen[:, 2])
    around = minimum_filter(lowest, 2 * _REACH + 1, mode="constant", cval=np.inf)
    known = np.isfinite(around)
    # A mean of minima that all include the place itself is still below it, and has no steps.
    size = 2 * _REACH - 1
    total, share_known = (
        map_coordinates(uniform_filter(grid, size, mode="constant"), place.T, order=1, mode="nearest")
        for grid in (np.where(known, around, 0.0), known.astype(np.float64))
    )
    floor = np.full(len(vertices), -np.inf)
    floor[visible] = share * np.clip(seen[:, 2] - total / share_known, 0.0, _HIGHEST)
    return floor
