"""Local depth order errors and their repair (section 3.2, Eq. 8, Appendix VI)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.distance import pdist

from o3d_relief.linalg.solve import solve_spd

__all__ = [
    "Restoration",
    "cluster_radii",
    "depth_order_error",
    "lift_loose",
    "lifting_discs",
    "order_errors",
    "restore",
    "smoothing_discs",
]

_SAME_HEIGHT = 1e-6
"""Heights closer than this, in relief units, have no order."""

_DISC = 0.5
"""Radius of the disc around a point that is smoothed, in cluster radii."""

_DIRECTIONS = 64

_LIFT = 3.0
"""Radius of the disc around a vertex that is lifted, in its distance to S."""

_ROUNDS = 30


@dataclass(frozen=True, kw_only=True, eq=False)
class Restoration:
    """The restored surface.

    Attributes
    ----------
    z : (n,) float64
    solved : (n,) bool
        The vertices that were solved again.
    points_held : int
        Fixed points that stayed fixed because nothing else held their component.
    set_on_plane : int
        Vertices that were set onto S.
    rounds : int
        Linear systems solved.
    """

    z: NDArray[np.float64]
    solved: NDArray[np.bool_]
    points_held: int
    set_on_plane: int
    rounds: int


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
    directions = np.stack([np.cos(angle), np.sin(angle)])
    order = np.argsort(labels, kind="stable")
    bounds = np.searchsorted(labels[order], np.arange(k + 1))
    radii = np.zeros(k)
    for cluster in range(k):
        members = xy[order[bounds[cluster] : bounds[cluster + 1]]]
        if len(members) > 2 * _DIRECTIONS:
            along = members @ directions
            members = members[np.concatenate([along.argmin(axis=0), along.argmax(axis=0)])]
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
    tree = cKDTree(vertices)
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
    for around in cKDTree(vertices).query_ball_point(vertices[index], _DISC * radii):
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
        own = np.flatnonzero(label == component)
        of_own = label[behind] == component
        for size in np.unique(step[of_own]):
            centres = behind[of_own & (step == size)]
            reach = _LIFT * 2.0 ** int(size)
            distance, _ = cKDTree(vertices[centres]).query(vertices[own], distance_upper_bound=reach)
            marked[own[np.isfinite(distance)]] = True
    return marked


def restore(
    vertices: NDArray[np.float64],
    laplacian: sp.csr_array,
    z: NDArray[np.float64],
    high: NDArray[np.bool_],
    index: NDArray[np.int64],
    label: NDArray[np.int32],
    *,
    blend: float = 0.9,
    in_front: NDArray[np.bool_] | None = None,
) -> Restoration:
    """Solve the vertices with high errors again, Appendix VI.

    (t L + (1 - t) L L) z'' = (t L + (1 - t) L L) z on the high vertices, the fixed points among them,
    with all others held. L is the dimensionless L = I - D^-1 A with D the row sums of the cotangent
    weights: the paper's Voronoi areas would make the blend depend on the unit, and are unstable on
    slivers. Multiplied by D the operator is the symmetric t C + (1 - t) C D^-1 C, and as in the
    construction it is solved for the displacement.

    The fixed points held the surface in front of S; set free, some of it would sink behind. Where
    `in_front` is given the system is therefore solved as the minimum of its quadratic form subject to
    z'' >= 0 there (an obstacle problem), by a primal-dual active set.

    Parameters
    ----------
    vertices : (n, 3) float64
        Original positions.
    laplacian : (n, n) sparse float64
        C.
    z : (n,) float64
        Heights after the construction.
    high : (n,) bool
        The vertices to solve again.
    index : (q,) int64
        The fixed points; they stay fixed in a component of which every vertex is high.
    label : (n,) int
        Connected component of each vertex; one without a fixed point is left as it is.
    blend : float
        t in [0, 1], the share of first order differentials.
    in_front : (n,) bool, optional
        Vertices that must not end behind S, if they are solved again; none where omitted.

    Returns
    -------
    Restoration

    Raises
    ------
    SolverError
        The linear system could not be solved to its tolerance.
    """
    components = int(label.max()) + 1
    whole = np.bincount(label, weights=~high, minlength=components) == 0
    held = index[whole[label[index]]]
    solved = high.copy()
    solved[held] = False
    # A component without a fixed point was moved as a whole and has no error to mend.
    has_point = np.zeros(components, dtype=bool)
    has_point[label[index]] = True
    solved &= has_point[label]

    bounded = np.zeros(len(z), dtype=bool) if in_front is None else in_front & solved
    system = _System(laplacian, np.flatnonzero(solved), blend)
    result, on_plane, rounds = _in_front(system, vertices[:, 2], z, bounded)
    return Restoration(
        z=result,
        solved=solved,
        points_held=len(held),
        set_on_plane=int(on_plane.sum()),
        rounds=rounds,
    )


def _in_front(
    system: _System, original: NDArray[np.float64], z: NDArray[np.float64], bounded: NDArray[np.bool_]
) -> tuple[NDArray[np.float64], NDArray[np.bool_], int]:
    """Solve subject to z >= 0 on `bounded`; return the heights, the vertices on the bound, the rounds."""
    on_plane = np.zeros(len(z), dtype=bool)
    rounds = 0
    while True:
        result, force = system.solve(original, np.where(on_plane, 0.0, z), on_plane)
        rounds += 1
        behind = bounded & ~on_plane & (result < -_SAME_HEIGHT)
        # A vertex that is pulled towards S, not held off it, is let go.
        released = on_plane & (force < 0.0)
        if not behind.any() and not released.any():
            break
        if rounds > _ROUNDS:
            # The active set goes round in a circle: from here on it only grows, and so comes to an end.
            released[:] = False
            if not behind.any():
                break
        on_plane = (on_plane & ~released) | behind
    return np.where(bounded, np.maximum(result, 0.0), result), on_plane, rounds


class _System:
    """The rows t C + (1 - t) C D^-1 C of some vertices."""

    def __init__(self, laplacian: sp.csr_array, rows: NDArray[np.int64], blend: float) -> None:
        first = laplacian[rows]
        weight_sum = laplacian.diagonal()
        inverse = np.where(weight_sum > 0.0, 1.0 / np.where(weight_sum > 0.0, weight_sum, 1.0), 0.0)
        second = first @ sp.diags_array(inverse) @ laplacian
        self._rows = rows
        self._first = first
        self._operator = (blend * first + (1.0 - blend) * second).tocsr()

    def solve(
        self, original: NDArray[np.float64], z: NDArray[np.float64], held: NDArray[np.bool_]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Solve for the rows that are not held; `z` counts everywhere else.

        Returns
        -------
        z : (n,) float64
        force : (n,) float64
            What pushes each held row towards the viewer; 0 elsewhere.
        """
        moving = ~held[self._rows]
        columns = self._rows[moving]
        displacement = z - original
        displacement[columns] = 0.0
        operator = self._operator[moving]
        displacement[columns] = solve_spd(
            operator[:, columns].tocsr(),
            -(operator @ displacement),
            similar=self._first[moving][:, columns].tocsr(),
        )
        force = np.zeros(len(z))
        force[self._rows[~moving]] = self._operator[~moving] @ displacement
        result = z.copy()
        result[columns] = original[columns] + displacement[columns]
        return result, force
