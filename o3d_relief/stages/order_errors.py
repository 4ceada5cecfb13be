"""What has to be restored: depth order errors, pimples, what sank behind S (section 3.2, Eq. 8)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.distance import pdist

__all__ = [
    "cluster_radii",
    "depth_order_error",
    "lift_loose",
    "lifting_discs",
    "order_errors",
    "smoothing_discs",
]

_SAME_HEIGHT = 1e-6
"""Heights closer than this, in relief units, have no order."""

_DISC = 0.5
"""Radius of the disc around a point that is smoothed, in cluster radii."""

_DIRECTIONS = 64

_MOST_CELLS = 512
"""Cells, along the longer side, in which vertices near those that are lifted are looked up."""

_LIFT = 3.0
"""Radius of the disc around a vertex that is lifted, in its distance to S."""


def cluster_radii(xy: NDArray[np.float64], labels: NDArray[np.int64], k: int) -> NDArray[np.float64]:
    """Find half of the largest distance between two vertices of each cluster, in x and y.

    Clusters are columns through the scene. Were depth to count, the neighbourhoods in a deep scene would
    reach through all of it, and order errors would no longer be local. The largest distance is measured
    between the vertices that are extreme in one of 64 directions, which finds it to within a thousandth
    in linear time.

    Parameters
    ----------
    xy : (n, 2) float64
    labels : (n,) int64
    k : int
        Number of clusters.

    Returns
    -------
    (k,) float64
        0 for a cluster without vertices.

    Examples
    --------
    >>> cluster_radii(np.array([[0.0, 0], [6, 8]]), np.array([0, 0]), 1).tolist()
    [5.0]
    """
    angle = np.arange(_DIRECTIONS) * np.pi / _DIRECTIONS
    directions = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    order = np.argsort(labels.astype(np.int32), kind="stable")
    bounds = np.concatenate([[0], np.cumsum(np.bincount(labels, minlength=k))])
    ordered = xy[order]
    radii = np.zeros(k)
    for cluster in range(k):
        members = ordered[bounds[cluster] : bounds[cluster + 1]]
        if len(members) > 2 * _DIRECTIONS:
            along = directions @ members.T
            members = members[np.concatenate([along.argmin(axis=1), along.argmax(axis=1)])]
        if len(members) > 1:
            radii[cluster] = pdist(members).max() / 2.0
    return radii


def depth_order_error(before: NDArray[np.float64], after: NDArray[np.float64]) -> NDArray[np.float64]:
    """Compare the depth order of one neighbourhood before and after, Eq. 8.

    epsilon = |rank' - rank| / p, the ranks by distance to S. Vertices at one height share an interval of
    ranks, and only a distance between the intervals is an error: a flat floor has no order to lose.

    Parameters
    ----------
    before, after : (p,) float64
        Heights of the same vertices, in relief units.

    Returns
    -------
    (p,) float64
        In [0, 1).

    Examples
    --------
    >>> depth_order_error(np.array([1.0, 2, 3, 4]), np.array([4.0, 2, 3, 1])).tolist()
    [0.75, 0.0, 0.0, 0.75]
    """
    low, high = _rank_interval(before)
    new_low, new_high = _rank_interval(after)
    apart = np.maximum(np.maximum(new_low - high, low - new_high), 0)
    return np.asarray(apart / len(before))


def _rank_interval(heights: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    steps = np.round(heights / _SAME_HEIGHT)
    ordered = np.sort(steps)
    return np.searchsorted(ordered, steps, "left"), np.searchsorted(ordered, steps, "right") - 1


def order_errors(
    vertices: NDArray[np.float64],
    z: NDArray[np.float64],
    index: NDArray[np.int64],
    radii: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Compute the depth order error of every vertex around the fixed points, Eq. 8.

    Parameters
    ----------
    vertices : (n, 3) float64
        Original positions, which define the neighbourhoods and the original order.
    z : (n,) float64
        Heights after the construction.
    index : (q,) int64
        The fixed points.
    radii : (q,) float64
        Radius of the neighbourhood of each, see `cluster_radii`.

    Returns
    -------
    (n,) float64
        The largest error over the neighbourhoods of a vertex, 0 outside all of them.
    """
    tree = cKDTree(vertices, balanced_tree=False, compact_nodes=False)  # few queries, built in half the time
    error = np.zeros(len(vertices))
    for point, radius in zip(index, radii, strict=True):
        around = np.asarray(tree.query_ball_point(vertices[point], radius), dtype=np.int64)
        error[around] = np.maximum(error[around], depth_order_error(vertices[around, 2], z[around]))
    return error


def smoothing_discs(
    vertices: NDArray[np.float64], index: NDArray[np.int64], radii: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Mark the vertices around each fixed point that are to be smoothed.

    A harmonic displacement has a logarithmic spike at each fixed point: a small pimple, whose order
    errors are too low for the paper's rule.

    Parameters
    ----------
    vertices : (n, 3) float64
        Original positions.
    index : (q,) int64
        The fixed points.
    radii : (q,) float64
        Radius of the cluster of each; the disc is the ball with half of it.

    Returns
    -------
    (n,) bool
    """
    marked = np.zeros(len(vertices), dtype=bool)
    tree = cKDTree(vertices, balanced_tree=False, compact_nodes=False)
    for around in tree.query_ball_point(vertices[index], _DISC * radii):
        marked[around] = True
    return marked


def lift_loose(
    z: NDArray[np.float64],
    label: NDArray[np.int32],
    index: NDArray[np.int64],
    visible: NDArray[np.bool_],
) -> NDArray[np.float64]:
    """Lift each component without a fixed point as a whole until nothing visible of it lies behind S.

    Parameters
    ----------
    z : (n,) float64
        Heights after the construction.
    label : (n,) int
        Connected component of each vertex.
    index : (q,) int64
        The fixed points.
    visible : (n,) bool

    Returns
    -------
    (n,) float64
    """
    lift = np.zeros(label.max() + 1)
    np.maximum.at(lift, label[visible], -z[visible])
    lift[label[index]] = 0.0
    return np.asarray(z + lift[label])


def lifting_discs(
    vertices: NDArray[np.float64],
    z: NDArray[np.float64],
    label: NDArray[np.int32],
    visible: NDArray[np.bool_],
) -> NDArray[np.bool_]:
    """Mark the surroundings of what is visible and lies behind S.

    Parameters
    ----------
    vertices : (n, 3) float64
        Original positions.
    z : (n,) float64
        Heights after the construction.
    label : (n,) int
        Connected component of each vertex.
    visible : (n,) bool

    Returns
    -------
    (n,) bool
        Around each visible vertex behind S, all vertices of its component within three times its
        distance to S, rounded up to a power of two: wide enough to lift it without a step, narrow enough to
        leave the rest alone.
    """
    marked = visible & (z < 0.0)
    behind = np.flatnonzero(marked)
    step = np.ceil(np.log2(np.maximum(-z[behind], _SAME_HEIGHT))).astype(np.int64)
    for component in np.unique(label[behind]):
        left = np.flatnonzero(label == component)
        of_own = label[behind] == component
        widest = _LIFT * 2.0 ** int(step[of_own].max())
        # What is out of the widest reach of all of them is out of every reach.
        left = left[_next_to(vertices[left], vertices[behind[of_own]], widest)]
        for size in np.unique(step[of_own])[::-1]:
            reach = _LIFT * 2.0 ** int(size)
            found = _within(vertices, left, behind[of_own & (step == size)], reach)
            marked[left[found]] = True
            left = left[~found]
    return marked


def _within(
    vertices: NDArray[np.float64], chosen: NDArray[np.int64], centres: NDArray[np.int64], reach: float
) -> NDArray[np.bool_]:
    """Tell which of chosen vertices lie within reach of any of the centres."""
    near = _next_to(vertices[chosen], vertices[centres], reach)
    distance, _ = cKDTree(vertices[centres]).query(vertices[chosen[near]], distance_upper_bound=reach)
    within = np.zeros(len(chosen), dtype=bool)
    within[near[np.isfinite(distance)]] = True
    return within


def _next_to(places: NDArray[np.float64], centres: NDArray[np.float64], reach: float) -> NDArray[np.int64]:
    """Return the numbers of places, (p, 3), in or next to the cells of centres, as seen from the front."""
    low, high = centres[:, :2].min(axis=0) - reach, centres[:, :2].max(axis=0) + reach
    (left, bottom), (right, top) = low, high
    x, y = places[:, 0], places[:, 1]
    near = np.flatnonzero((x >= left) & (x <= right) & (y >= bottom) & (y <= top))
    size = max(reach, float((high - low).max()) / _MOST_CELLS)
    marked = np.zeros(((high - low) / size).astype(np.int64) + 3, dtype=bool)
    row, column = ((centres[:, :2] - low) / size).astype(np.int64).T + 1
    for above in (-1, 0, 1):
        for beside in (-1, 0, 1):
            marked[row + above, column + beside] = True
    row, column = (
        ((line[near] - start) / size).astype(np.int32) + 1 for line, start in ((x, left), (y, bottom))
    )
    return np.asarray(near[marked[row, column]])
