"""Local repair with higher order differential coordinates (section 3.2, Appendix VI)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from o3d_relief.linalg.obstacle import minimise_above
from o3d_relief.progress import Tick, silent

__all__ = ["Restoration", "restore"]

_EXACT = 1e-6
"""Energy norm of the error, in relief units, to which the system is solved."""


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
    set_on_floor : int
        Vertices that came to lie as low as they may.
    rounds : int
        Linear systems solved.
    """

    z: NDArray[np.float64]
    solved: NDArray[np.bool_]
    points_held: int
    set_on_floor: int
    rounds: int


def restore(
    vertices: NDArray[np.float64],
    laplacian: sp.csr_array,
    z: NDArray[np.float64],
    high: NDArray[np.bool_],
    index: NDArray[np.int64],
    label: NDArray[np.int32],
    *,
    blend: float = 0.9,
    floor: NDArray[np.float64] | None = None,
    tick: Tick = silent,
) -> Restoration:
    """Solve the vertices with high errors again, Appendix VI.

    (t L + (1 - t) L L) z'' = (t L + (1 - t) L L) z on the high vertices, the fixed points among them,
    with all others held. L is the dimensionless L = I - D^-1 A with D the row sums of the cotangent
    weights: the paper's Voronoi areas would make the blend depend on the unit, and are unstable on
    slivers. Multiplied by D the operator is the symmetric t C + (1 - t) C D^-1 C, and as in the
    construction it is solved for the displacement.

    The fixed points held the surface in front of S; set free, some of it would sink behind. Where
    a floor is given the system is therefore solved as the minimum of its quadratic form subject to
    z'' >= floor (an obstacle problem), by a primal-dual active set.

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
    floor : (n,) float64, optional
        How low the vertices that are solved again may come to lie; minus infinity, or omitted, for any
        height.
    tick : callable, optional
        Called in every step of the linear solver; it may raise to end the work.

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

    rows = np.flatnonzero(solved)
    first, operator = _operators(laplacian, rows, blend)
    displacement = z - vertices[:, 2]
    displacement[rows] = 0.0
    lowest = np.full(len(rows), -np.inf) if floor is None else floor[rows]
    found = minimise_above(
        operator[:, rows].tocsr(),
        -(operator @ displacement),
        lowest - vertices[rows, 2],
        similar=first[:, rows].tocsr(),
        error=_EXACT,
        tick=tick,
    )
    result = z.copy()
    result[rows] = np.where(found.on_bound, lowest, np.maximum(vertices[rows, 2] + found.x, lowest))
    return Restoration(
        z=result,
        solved=solved,
        points_held=len(held),
        set_on_floor=int(found.on_bound.sum()),
        rounds=found.rounds,
    )


def _operators(
    laplacian: sp.csr_array, rows: NDArray[np.int64], blend: float
) -> tuple[sp.csr_array, sp.csr_array]:
    """Return some rows, (r, n), of C and of t C + (1 - t) C D^-1 C."""
    first = laplacian[rows]
    weight_sum = laplacian.diagonal()
    inverse = np.where(weight_sum > 0.0, 1.0 / np.where(weight_sum > 0.0, weight_sum, 1.0), 0.0)
    second = first @ sp.diags_array(inverse) @ laplacian
    return first, (blend * first + (1.0 - blend) * second).tocsr()
