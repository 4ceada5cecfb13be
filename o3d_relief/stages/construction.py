"""The surface rebuilt around the moved points (section 3.2, Eqs. 6-7, Appendix V)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from o3d_relief.linalg.solve import solve_spd

__all__ = ["Construction", "construct"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Construction:
    """The result of Eq. 7.

    Attributes
    ----------
    z : (n,) float64
    components : int
        Connected components of the mesh.
    loose_components : int
        Components, or tied groups of them, without a fixed point, which were moved as a whole.
    """

    z: NDArray[np.float64]
    components: int
    loose_components: int


def construct(
    vertices: NDArray[np.float64],
    laplacian: sp.csr_array,
    index: NDArray[np.int64],
    new_height: NDArray[np.float64],
    *,
    ties: sp.csr_array | None = None,
    pull: NDArray[np.float64] | None = None,
) -> Construction:
    """Find the z of all vertices from fixed points and differential coordinates.

    minimise  sum over the free vertices of |L z' - L z|^2   subject to  z'_index = new_height  (Eqs. 6, 7).

    The system is square, so the minimum is zero; multiplied row by row with the Voronoi areas, and
    written for the displacement d = z' - z, it says that d is discrete harmonic: C_ff d_f = -C_fc d_c
    with the symmetric cotangent Laplacian C. Solving for d avoids the cancellation in L z.

    Springs between components may be added to the system: (C + ties)_ff d_f = pull_f - (C + ties)_fc d_c.

    A connected component without a fixed point, and not tied to one, has no equation. It moves as a
    whole, by the displacement of the nearest vertex (in space) of the components that have one, so that
    Eq. 7 holds on it as well.

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
    ties : (n, n) sparse float64, optional
        Quadratic form of the springs.
    pull : (n,) float64, optional
        Their right-hand side; zero where omitted.

    Returns
    -------
    Construction

    Raises
    ------
    SolverError
        The linear system could not be solved.
    """
    z = vertices[:, 2]
    components, _ = connected_components(laplacian, directed=False)
    system = laplacian if ties is None else (laplacian + ties).tocsr()
    groups, label = connected_components(system, directed=False)
    has_point = np.zeros(groups, dtype=bool)
    has_point[label[index]] = True
    controlled = has_point[label]
    fixed = np.zeros(len(z), dtype=bool)
    fixed[index] = True
    displacement = np.zeros(len(z))
    displacement[index] = new_height - z[index]

    free = np.flatnonzero(controlled & ~fixed)
    rows = system[free]
    right_hand_side = -(rows @ displacement)
    if pull is not None:
        right_hand_side += pull[free]
    displacement[free] = solve_spd(rows[:, free].tocsr(), right_hand_side)
    _move_loose(vertices, label, controlled, displacement)

    moved = z + displacement
    moved[index] = new_height
    return Construction(z=moved, components=components, loose_components=int((~has_point).sum()))


def _move_loose(
    vertices: NDArray[np.float64],
    label: NDArray[np.int32],
    controlled: NDArray[np.bool_],
    displacement: NDArray[np.float64],
) -> None:
    """Give each loose component, in place, the displacement of the controlled vertex nearest to it."""
    loose = np.flatnonzero(~controlled)
    if len(loose) == 0:
        return
    candidates = np.flatnonzero(controlled)
    distance, nearest = cKDTree(vertices[candidates]).query(vertices[loose])
    order = np.lexsort((distance, label[loose]))
    components, first = np.unique(label[loose][order], return_index=True)
    leader = candidates[nearest[order[first]]]
    displacement[loose] = displacement[leader][np.searchsorted(components, label[loose])]
