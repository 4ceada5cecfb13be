"""The nearest neighbours of points, and what their distances tell: spacing and outliers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

__all__ = ["Neighbours", "find_neighbours", "local_spacings", "outliers", "thin"]

_COUNT = 20
"""Neighbours of each point: enough to average noise away, few enough to stay local."""

_SPACING_FROM = 8
"""The spacing is read from the circle that holds this many neighbours."""

_LEAST_SPREAD = 0.3
"""Standard deviation of the logarithms of distances, at least: three times the median is never an outlier."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Neighbours:
    """The nearest neighbours of each of n points, nearest first.

    Attributes
    ----------
    index : (n, k) int64
    distance : (n, k) float64
    """

    index: NDArray[np.int64]
    distance: NDArray[np.float64]


def find_neighbours(points: NDArray[np.float64]) -> Neighbours:
    """Find the 20 nearest neighbours of each point, or all where there are fewer.

    Parameters
    ----------
    points : (n, 3) float64
        Finite, n >= 2.

    Returns
    -------
    Neighbours
        Without the point itself.

    Examples
    --------
    >>> find_neighbours(np.array([[0, 0, 0], [1, 0, 0], [3, 0, 0.0]])).distance.tolist()
    [[1.0, 3.0], [1.0, 2.0], [2.0, 3.0]]
    """
    count = min(_COUNT, len(points) - 1)
    distance, index = cKDTree(points).query(points, k=count + 1, workers=-1)
    # The point itself comes first, or second behind one at the same place: neither distance says more than 0.
    own = index == np.arange(len(points))[:, None]
    own[~own.any(axis=1), -1] = True
    return Neighbours(
        index=index[~own].reshape(-1, count).astype(np.int64), distance=distance[~own].reshape(-1, count)
    )


def local_spacings(neighbours: Neighbours) -> NDArray[np.float64]:
    """Find the side of the square that each point stands for.

    A circle around the point that holds k neighbours has the area of k such squares. This holds for regular
    and for random points alike, and two scans laid over each other do not bring it to nothing, as they do
    with the distance to the nearest neighbour.

    Parameters
    ----------
    neighbours : Neighbours

    Returns
    -------
    (n,) float64
        In the unit of the distances.

    Examples
    --------
    >>> line = np.arange(30.0)
    >>> plane = np.stack([*np.meshgrid(line, line), np.zeros((30, 30))], axis=-1).reshape(-1, 3)
    >>> round(float(np.median(local_spacings(find_neighbours(plane)))), 2)
    0.89
    """
    count = min(_SPACING_FROM, neighbours.distance.shape[1])
    return np.asarray(neighbours.distance[:, count - 1] * np.sqrt(np.pi / count))


def outliers(distance: NDArray[np.float64], deviations: float) -> NDArray[np.bool_]:
    """Find points that lie far from all others.

    The statistical outliers of Rusu et al. (2008), with two changes: the logarithms of the mean distances are
    compared, and median and median absolute deviation stand in for mean and deviation, so that neither
    outliers nor a varying density shift the threshold much.

    Parameters
    ----------
    distance : (n,) float64
        Mean distance of each point to its neighbours, in any unit.
    deviations : float
        Standard deviations above the median.

    Returns
    -------
    (n,) bool

    Examples
    --------
    >>> outliers(np.array([1.0, 1.1, 0.9, 1.0, 9.0]), 3.0).tolist()
    [False, False, False, False, True]
    """
    logarithm = np.log(np.maximum(distance, np.finfo(np.float64).tiny))
    middle = np.median(logarithm)
    spread = 1.4826 * float(np.median(np.abs(logarithm - middle)))
    return np.asarray(logarithm > middle + deviations * max(spread, _LEAST_SPREAD))


def thin(points: NDArray[np.float64], cell: float) -> NDArray[np.int64]:
    """Choose one point in each cell of a cubic grid.

    Parameters
    ----------
    points : (n, 3) float64
    cell : float
        Width of the cells; 0 keeps all points.

    Returns
    -------
    (m,) int64
        The chosen points, ascending: in each cell the first.

    Examples
    --------
    >>> thin(np.array([[0, 0, 0], [0.4, 0, 0], [1.2, 0, 0]]), 1.0).tolist()
    [0, 2]
    """
    if cell <= 0.0:
        return np.arange(len(points))
    place = np.floor((points - points.min(axis=0)) / cell).astype(np.int64)
    _, first = np.unique(place, axis=0, return_index=True)
    return np.asarray(np.sort(first), dtype=np.int64)
