"""Local depth order errors and their repair (section 3.2, Eq. 8, Appendix VI)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree
from scipy.spatial.distance import pdist

from o3d_relief.linalg.solve import solve_spd

__all__ = ["Restoration", "cluster_radii", "depth_order_error", "order_errors", "restore", "smoothing_discs"]

_SAME_HEIGHT = 1e-6
"""Heights closer than this, in relief units, have no order."""

_DISC = 0.3
"""Radius of the disc around a point that is smoothed, in cluster radii."""

_DIRECTIONS = 64


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
    """

    z: NDArray[np.float64]
    solved: NDArray[np.bool_]
    points_held: int
    set_on_plane: int


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
        Radius of the cluster of each; the disc is the ball with 0.3 of it.

    Returns
    -------
    (n,) bool
    """
    marked = np.zeros(len(vertices), dtype=bool)
    for around in cKDTree(vertices).query_ball_point(vertices[index], _DISC * radii):
        marked[around] = True
    return marked


def restore(
    vertices: NDArray[np.float64],
    laplacian: sp.csr_array,
    z: NDArray[np.float64],
    high: NDArray[np.bool_],
    index: NDArray[np.int64],
    visible: NDArray[np.bool_],
    *,
    blend: float = 0.9,
) -> Restoration:
    """Solve the vertices with high errors again, Appendix VI.

    (t L + (1 - t) L L) z'' = (t L + (1 - t) L L) z on the high vertices, the fixed points among them,
    with all others held. L is the dimensionless L = I - D^-1 A with D the row sums of the cotangent
    weights: the paper's Voronoi areas would make the blend depend on the unit, and are unstable on
    slivers. Multiplied by D the operator is the symmetric t C + (1 - t) C D^-1 C, and as in the
    construction it is solved for the displacement.

    The fixed points held the surface in front of S; set free, some of it would sink behind. What is
    visible and in front must stay there: where it does not, the lowest vertices are set onto S and the
    rest is solved again, until none is behind.

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
    visible : (n,) bool
    blend : float
        t in [0, 1], the share of first order differentials.

    Returns
    -------
    Restoration

    Raises
    ------
    SolverError
        The linear system could not be solved to 1e-10.
    """
    components, label = connected_components(laplacian, directed=False)
    whole = np.bincount(label, weights=~high, minlength=components) == 0
    held = index[whole[label[index]]]
    solved = high.copy()
    solved[held] = False
    # A component in which nothing is held was moved as a whole and has no error to mend.
    anchored = np.bincount(label, weights=~solved, minlength=components) > 0
    solved &= anchored[label]

    in_front = visible & (z >= 0.0)
    on_plane = np.zeros(len(z), dtype=bool)
    result = z
    system = _System(laplacian, np.flatnonzero(solved), blend)
    while True:
        fixed = np.where(on_plane, 0.0, z) - vertices[:, 2]
        result = system.solve(vertices[:, 2], fixed, on_plane)
        behind = in_front & ~on_plane & (result < -_SAME_HEIGHT)
        if not behind.any():
            break
        on_plane |= _lowest(laplacian, result, behind)
    return Restoration(z=result, solved=solved, points_held=len(held), set_on_plane=int(on_plane.sum()))


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
        self, original: NDArray[np.float64], displacement: NDArray[np.float64], held: NDArray[np.bool_]
    ) -> NDArray[np.float64]:
        """Return the new heights; `displacement` counts where a vertex is no row, or held."""
        moving = ~held[self._rows]
        columns = self._rows[moving]
        outside = displacement.copy()
        outside[columns] = 0.0
        operator = self._operator[moving]
        outside[columns] = solve_spd(
            operator[:, columns].tocsr(),
            -(operator @ outside),
            similar=self._first[moving][:, columns].tocsr(),
        )
        return np.asarray(original + outside)


def _lowest(
    laplacian: sp.csr_array, z: NDArray[np.float64], candidates: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Mark the candidates that no neighbouring candidate undercuts."""
    among = laplacian[np.flatnonzero(candidates)][:, np.flatnonzero(candidates)].tocoo()
    heights = z[candidates]
    undercut = np.zeros(len(heights), dtype=bool)
    undercut[among.row[heights[among.col] < heights[among.row]]] = True
    marked = np.zeros(len(z), dtype=bool)
    marked[np.flatnonzero(candidates)[~undercut]] = True
    return marked
