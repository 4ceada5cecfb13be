"""The surface rebuilt around the moved points (section 3.2, Eqs. 6-7, Appendix V)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from o3d_relief.linalg.solve import FACTORISED_UP_TO, solve_spd
from o3d_relief.progress import Tick, silent

__all__ = ["Construction", "construct", "leaders"]


_EXACT = 1e-6
"""Energy norm of the error, in relief units, to which the displacement is solved: heights are then exact to
1e-8 of the extent."""

_SMALL_PART = 20000
_FEW_UNKNOWNS = 200000
"""Scenes of no part with more vertices, and of no more unknowns, are factorised: their factors are sparse."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Construction:
    """The result of Eq. 7.

    Attributes
    ----------
    z : (n,) float64
    components : int
        Connected components of the mesh.
    loose_components : int
        Components without a fixed point, and not tied to one, which were moved as a whole.
    """

    z: NDArray[np.float64]
    components: int
    loose_components: int


Springs = tuple[sp.csr_array, NDArray[np.float64]]
"""A quadratic form (n, n) and the right-hand side (n,) that belongs to it."""


def construct(
    vertices: NDArray[np.float64],
    laplacian: sp.csr_array,
    index: NDArray[np.int64],
    new_height: NDArray[np.float64],
    *,
    among_held: Springs | None = None,
    to_loose: Springs | None = None,
    tick: Tick = silent,
) -> Construction:
    """Find the z of all vertices from fixed points and differential coordinates.

    minimise  sum over the free vertices of |L z' - L z|^2   subject to  z'_index = new_height  (Eqs. 6, 7).

    The system is square, so the minimum is zero; multiplied row by row with the Voronoi areas, and
    written for the displacement d = z' - z, it says that d is discrete harmonic: C_ff d_f = -C_fc d_c
    with the symmetric cotangent Laplacian C. Solving for d avoids the cancellation in L z.

    A connected component without a fixed point is loose: it has no equation. Springs may tie it to
    others; it is then solved after them, (C + springs)_ff d_f = pull_f - (C + springs)_fc d_c, so that it
    follows and does not pull. Untied, it moves as a whole, by the displacement of the nearest vertex (in
    space) that is not loose, so that Eq. 7 holds on it as well. Springs among components with fixed points
    are added to the first system.

    Parameters
    ----------
    vertices : (n, 3) float64
        In the relief frame; only z moves.
    laplacian : (n, n) sparse float64
        C, see `o3d_relief.linalg.laplacian.cotangent_laplacian`.
    index : (q,) int64
        The fixed vertices, at least one, each once.
    new_height : (q,) float64
        Their z.
    among_held : quadratic form and right-hand side, optional
        Springs between components with fixed points.
    to_loose : quadratic form and right-hand side, optional
        Springs with an end on a loose component.
    tick : callable, optional
        Called in every step of the linear solver; it may raise to end the work.

    Returns
    -------
    Construction

    Raises
    ------
    SolverError
        The linear system could not be solved.
    """
    z = vertices[:, 2]
    components, label = connected_components(laplacian, directed=False)
    held = np.isin(label, label[index])
    fixed = np.zeros(len(z), dtype=bool)
    fixed[index] = True
    displacement = np.zeros(len(z))
    displacement[index] = new_height - z[index]
    _solve_free(laplacian, among_held, held & ~fixed, displacement, tick)

    known = held
    if to_loose is not None:
        _, group = connected_components(laplacian + to_loose[0], directed=False)
        known = np.isin(group, group[held])
        _solve_free(laplacian, to_loose, known & ~held, displacement, tick)
    _move_loose(vertices, label, known, displacement)

    moved = z + displacement
    moved[index] = new_height
    loose = len(np.unique(label[~known]))
    return Construction(z=moved, components=components, loose_components=loose)


def _solve_free(
    laplacian: sp.csr_array,
    springs: Springs | None,
    free_mask: NDArray[np.bool_],
    displacement: NDArray[np.float64],
    tick: Tick,
) -> None:
    """Solve for the displacement of the free vertices, in place."""
    free = np.flatnonzero(free_mask)
    rows = laplacian[free]
    right_hand_side = np.zeros(len(free))
    direct_up_to = FACTORISED_UP_TO
    if springs is not None:
        if np.bincount(connected_components(laplacian, directed=False)[1]).max() <= _SMALL_PART:
            direct_up_to = _FEW_UNKNOWNS
        form, pull = springs
        rows = (rows + form[free]).tocsr()
        right_hand_side = pull[free]
    displacement[free] = 0.0
    right_hand_side = right_hand_side - rows @ displacement
    displacement[free] = solve_spd(
        rows[:, free].tocsr(), right_hand_side, direct_up_to=direct_up_to, error=_EXACT, tick=tick
    )


def _move_loose(
    vertices: NDArray[np.float64],
    label: NDArray[np.int32],
    controlled: NDArray[np.bool_],
    displacement: NDArray[np.float64],
) -> None:
    """Give each loose component, in place, the displacement of the controlled vertex nearest to it."""
    leader = leaders(vertices, label, controlled)
    displacement[~controlled] = displacement[leader]


def leaders(
    vertices: NDArray[np.float64], label: NDArray[np.int32], controlled: NDArray[np.bool_]
) -> NDArray[np.int64]:
    """Find the vertex that each vertex of a loose component follows.

    Parameters
    ----------
    vertices : (n, 3) float64
    label : (n,) int
        Connected component of each vertex.
    controlled : (n,) bool
        The vertices of components that are not loose.

    Returns
    -------
    (l,) int64
        For each vertex that is not controlled the controlled one that is nearest to its component.
    """
    loose = np.flatnonzero(~controlled)
    if len(loose) == 0:
        return loose
    candidates = np.flatnonzero(controlled)
    distance, nearest = cKDTree(vertices[candidates]).query(vertices[loose])
    order = np.lexsort((distance, label[loose]))
    components, first = np.unique(label[loose][order], return_index=True)
    leader = candidates[nearest[order[first]]]
    return np.asarray(leader[np.searchsorted(components, label[loose])], dtype=np.int64)
