"""Local repair with higher order differential coordinates (section 3.2, Appendix VI)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from o3d_relief.linalg.solve import solve_spd
from o3d_relief.progress import Tick, silent

__all__ = ["Restoration", "restore"]

_BELOW = 1e-6
"""Relief units below the floor that count as on it in the search; the result is set onto it."""

_EXACT = 1e-6
"""Energy norm of the error, in relief units, to which each system is solved."""

_ROUGH = 1e-3
"""The same while the vertices on the floor are still being found."""

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

    lowest = np.where(solved, -np.inf if floor is None else floor, -np.inf)
    system = _System(laplacian, np.flatnonzero(solved), blend, tick)
    result, on_floor, rounds = _above_floor(system, vertices[:, 2], z, lowest)
    return Restoration(
        z=result,
        solved=solved,
        points_held=len(held),
        set_on_floor=int(on_floor.sum()),
        rounds=rounds,
    )


def _above_floor(
    system: _System,
    original: NDArray[np.float64],
    z: NDArray[np.float64],
    floor: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.bool_], int]:
    """Solve subject to z >= floor; return the heights, the vertices on the floor, the rounds."""
    on_floor = np.zeros(len(z), dtype=bool)
    rounds = 0
    error = _ROUGH if np.isfinite(floor).any() else _EXACT
    while True:
        result, force = system.solve(original, np.where(on_floor, floor, z), on_floor, error)
        rounds += 1
        below = ~on_floor & (result < floor - _BELOW)
        # A vertex that is pulled towards the floor, not held off it, is let go.
        released = on_floor & (force < 0.0)
        if rounds > _ROUNDS:
            # The active set goes round in a circle: from here on it only grows, and so comes to an end.
            released[:] = False
        if not below.any() and not released.any():
            if error == _EXACT:
                break
            error = _EXACT
        on_floor = (on_floor & ~released) | below
    return np.maximum(result, floor), on_floor, rounds


class _System:
    """The rows t C + (1 - t) C D^-1 C of some vertices."""

    def __init__(self, laplacian: sp.csr_array, rows: NDArray[np.int64], blend: float, tick: Tick) -> None:
        first = laplacian[rows]
        weight_sum = laplacian.diagonal()
        inverse = np.where(weight_sum > 0.0, 1.0 / np.where(weight_sum > 0.0, weight_sum, 1.0), 0.0)
        second = first @ sp.diags_array(inverse) @ laplacian
        self._rows = rows
        self._tick = tick
        self._operator = (blend * first + (1.0 - blend) * second).tocsr()
        self._within, self._first = self._operator[:, rows].tocsr(), first[:, rows].tocsr()
        self._displacement = np.zeros(len(rows))

    def solve(
        self,
        original: NDArray[np.float64],
        z: NDArray[np.float64],
        held: NDArray[np.bool_],
        error: float,
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Solve for the rows that are not held; `z` counts everywhere else.

        Starts from what was found the last time, when mostly the same rows were held.

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
        found = solve_spd(
            _holding(self._within, moving),
            np.where(moving, -(self._operator @ displacement), 0.0),
            similar=_holding(self._first, moving),
            error=error,
            start=np.where(moving, self._displacement, 0.0),
            tick=self._tick,
        )
        displacement[columns] = found[moving]
        self._displacement = displacement[self._rows]
        force = np.zeros(len(z))
        force[self._rows[~moving]] = (self._operator @ displacement)[~moving]
        result = z.copy()
        result[columns] = original[columns] + displacement[columns]
        return result, force


def _holding(matrix: sp.csr_array, moving: NDArray[np.bool_]) -> sp.csr_array:
    """Return a matrix of which the rows and columns that do not move have their diagonal left alone."""
    if moving.all():
        return matrix
    row = np.repeat(np.arange(len(moving)), np.diff(matrix.indptr))
    stays = (moving[row] & moving[matrix.indices]) | (row == matrix.indices)
    count = np.concatenate([[0], np.cumsum(stays)])
    parts = matrix.data[stays], matrix.indices[stays], count[matrix.indptr]
    return sp.csr_array(parts, shape=matrix.shape)
