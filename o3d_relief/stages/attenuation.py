"""Attenuation points: chosen, attached, scaled or discarded (section 3.2, Eqs. 1-5, Appendix IV)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from o3d_relief.linalg.box import box_minimum
from o3d_relief.linalg.one_thread import one_thread

__all__ = [
    "NewHeights",
    "actions",
    "attenuate",
    "differentials",
    "nearest_neighbours",
    "new_heights",
    "relative_differentials",
    "select_points",
]

NEIGHBOURS = 4
"""Neighbours of an attenuation point in Eq. 1."""

_SAME_HEIGHT = 1e-6
"""Heights closer than this, in relief units, count as equal."""


def select_points(
    vertices: NDArray[np.float64],
    visible: NDArray[np.bool_],
    labels: NDArray[np.int64],
    centers: NDArray[np.float64],
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Choose the visible vertex nearest to S in each cluster.

    Among vertices at the same distance (a flat floor) the one nearest to the cluster's centre is chosen.

    Parameters
    ----------
    vertices : (n, 3) float64
        In the relief frame, in relief units.
    visible : (n,) bool
    labels : (n,) int64
        Cluster of each vertex.
    centers : (k, 2) float64
        Centre of each cluster.

    Returns
    -------
    index : (p,) int64
        The attenuation points, p <= k: a cluster without a visible vertex has none.
    cluster : (p,) int64
        Their clusters, ascending.
    """
    seen = np.flatnonzero(visible)
    height = np.round(vertices[seen, 2] / _SAME_HEIGHT)
    off_centre = np.linalg.norm(vertices[seen, :2] - centers[labels[seen]], axis=1)
    order = np.lexsort((np.round(off_centre / _SAME_HEIGHT), height, labels[seen]))
    cluster, first = np.unique(labels[seen][order], return_index=True)
    return seen[order[first]], cluster


def nearest_neighbours(xy: NDArray[np.float64], *, symmetric: bool) -> sp.csr_array:
    """Build the adjacency matrix A of the 4 nearest neighbours of each point in x and y.

    Parameters
    ----------
    xy : (p, 2) float64
    symmetric : bool
        Make two points neighbours where either is among the nearest of the other.

    Returns
    -------
    (p, p) sparse float64, CSR
        A_ij = 1 where j is a neighbour of i; empty for a single point.
    """
    p = len(xy)
    count = min(NEIGHBOURS, p - 1)
    if count == 0:
        return sp.csr_array((p, p))
    _, found = cKDTree(xy).query(xy, k=count + 1)
    found = np.asarray(found).reshape(p, count + 1)
    # A point is usually its own first hit, but not where two points share one position.
    is_self = found == np.arange(p)[:, None]
    is_self[~is_self.any(axis=1), -1] = True
    column = found[~is_self]
    row = np.repeat(np.arange(p), count)
    directed = sp.coo_array((np.ones(len(row)), (row, column)), shape=(p, p)).tocsr()
    return directed.maximum(directed.T).tocsr() if symmetric else directed


def differentials(heights: NDArray[np.float64], neighbours: sp.csr_array) -> NDArray[np.float64]:
    """Compute the differential relief distances, Eq. 1.

    The height of each point less the mean height of its neighbours: L h with L = I - D^-1 A of Appendix
    IV.

    Parameters
    ----------
    heights : (p,) float64
    neighbours : (p, p) sparse float64
        Adjacency matrix A; a point without neighbours has the differential 0.

    Returns
    -------
    (p,) float64

    Examples
    --------
    >>> differentials(np.array([1.0, 5.0]), sp.csr_array(np.array([[0.0, 1], [1, 0]]))).tolist()
    [-4.0, 4.0]
    """
    return np.asarray(_laplacian(neighbours) @ heights)


def _laplacian(neighbours: sp.csr_array) -> sp.csr_array:
    """L = I - D^-1 A, with a zero row for a point without neighbours."""
    degree = np.asarray(neighbours.sum(axis=1)).ravel()
    has_some = degree > 0
    inverse = np.where(has_some, 1.0 / np.maximum(degree, 1.0), 0.0)
    return (sp.diags_array(has_some.astype(float)) - sp.diags_array(inverse) @ neighbours).tocsr()


def relative_differentials(differential: NDArray[np.float64]) -> NDArray[np.float64]:
    """Map differentials linearly onto [0, 1], Eq. 2.

    Parameters
    ----------
    differential : (p,) float64

    Returns
    -------
    (p,) float64
        rho; all 0 where the differentials have no range (one point, or all equal).

    Examples
    --------
    >>> relative_differentials(np.array([-4.0, 0, 4])).tolist()
    [0.0, 0.5, 1.0]
    """
    low, high = differential.min(), differential.max()
    if high - low <= _SAME_HEIGHT:
        return np.zeros(len(differential))
    return np.asarray((differential - low) / (high - low))


def actions(rho: NDArray[np.float64], *, discard_above: float, attach_below: float) -> NDArray[np.str_]:
    """Decide what becomes of each point.

    Parameters
    ----------
    rho : (p,) float64
        Relative differentials in [0, 1].
    discard_above : float
        t1: a point with a larger rho stands out from its neighbours and would deform the scene.
    attach_below : float
        t2: a point with a smaller rho lies deeper than its neighbours. The lowest point (rho = 0) is
        always attached.

    Returns
    -------
    (p,) str
        "attach", "scale" or "discard".

    Examples
    --------
    >>> actions(np.array([0.1, 0.3, 0.6, 0.7]), discard_above=0.6, attach_below=0.3).tolist()
    ['attach', 'scale', 'scale', 'discard']
    """
    attach = (rho < attach_below) | (rho == 0.0)
    return np.where(attach, "attach", np.where(rho > discard_above, "discard", "scale"))


def attenuate(differential: NDArray[np.float64], beta: NDArray[np.float64]) -> NDArray[np.float64]:
    """Scale differentials down, large ones more than small ones, Eq. 3.

    arctan(beta x) / beta, which tends to x as beta tends to 0.

    Parameters
    ----------
    differential : (p,) float64
        In relief units.
    beta : (p,) float64
        Attenuation factors, at least 0, per relief unit.

    Returns
    -------
    (p,) float64

    Examples
    --------
    >>> attenuate(np.array([5.0, 5.0]), np.array([0.2, 0.0])).round(3).tolist()
    [3.927, 5.0]
    """
    # Below this beta x the arctangent differs from its argument by less than 1e-18.
    tiny = np.abs(beta * differential) < 1e-9
    safe = np.where(tiny, 1.0, beta)
    return np.where(tiny, differential, np.arctan(safe * differential) / safe)


@dataclass(frozen=True, kw_only=True, eq=False)
class NewHeights:
    """The result of Eq. 5.

    Attributes
    ----------
    action : (p,) str
        As given, but for points that were attached because their group had no attached point.
    new_height : (p,) float64
        NaN where discarded.
    groups_attached : int
        Groups of neighbours that were given an attached point.
    """

    action: NDArray[np.str_]
    new_height: NDArray[np.float64]
    groups_attached: int


def new_heights(
    points: NDArray[np.float64],
    rho: NDArray[np.float64],
    action: NDArray[np.str_],
    beta: NDArray[np.float64],
) -> NewHeights:
    """Find the new heights of the points that are kept, Eqs. 3-5.

    minimise  |L h' - (Delta h)'|^2 + sum over attached points of h'_i^2   subject to  0 <= h' <= h.

    The paper is open in three points. Discarded points are gone: neighbours, differentials and L are
    those of the kept points among themselves. The relation of being neighbours is made symmetric, and
    each connected group of neighbours without an attached point has the one with the lowest rho attached,
    or the system would be rank-deficient and the group float. And no point moves behind S or away from
    it: without the bounds, large parts of a scene end up behind S.

    Parameters
    ----------
    points : (p, 3) float64
        The attenuation points in the relief frame, in relief units.
    rho : (p,) float64
        Relative differentials.
    action : (p,) str
        "attach", "scale" or "discard".
    beta : (p,) float64
        Attenuation factors.

    Returns
    -------
    NewHeights
    """
    kept = np.flatnonzero(action != "discard")
    height = points[kept, 2]
    neighbours = nearest_neighbours(points[kept, :2], symmetric=True)
    attached = action[kept] == "attach"
    added = _lowest_of_loose_groups(neighbours, attached, rho[kept])
    attached[added] = True
    wanted = attenuate(differentials(height, neighbours), beta[kept])

    settled = action.copy()
    settled[kept[added]] = "attach"
    result = np.full(len(points), np.nan)
    result[kept] = _bounded_least_squares(_laplacian(neighbours), wanted, attached, height)
    return NewHeights(action=settled, new_height=result, groups_attached=len(added))


def _lowest_of_loose_groups(
    neighbours: sp.csr_array, attached: NDArray[np.bool_], rho: NDArray[np.float64]
) -> NDArray[np.int64]:
    """Return the point of lowest rho of each connected group that has no attached point."""
    groups, label = connected_components(neighbours, directed=False)
    loose = np.bincount(label, weights=attached, minlength=groups) == 0
    order = np.lexsort((rho, label))
    _, first = np.unique(label[order], return_index=True)
    return np.asarray(order[first][loose], dtype=np.int64)


def _bounded_least_squares(
    laplacian: sp.csr_array,
    wanted: NDArray[np.float64],
    attached: NDArray[np.bool_],
    height: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Solve Eq. 5 with 0 <= h' <= h; a point that lies on S already stays there."""
    free = height > _SAME_HEIGHT
    result = np.zeros(len(height))
    if not free.any():
        return result
    columns = laplacian[:, free]
    normal = (columns.T @ columns + sp.diags_array(attached[free].astype(float))).tocsr()
    with one_thread():
        result[free] = box_minimum(normal, columns.T @ wanted, height[free])
    return result
