"""Harmonic responses: how a surface follows each of its fixed points."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from o3d_relief.linalg.factor import Factor
from o3d_relief.linalg.one_thread import one_thread
from o3d_relief.progress import Tick, silent

__all__ = ["Responses"]

_BLOCK = 32
"""Points whose responses are solved for at once; more would only take more memory."""


class Responses:
    """What every vertex does when one fixed point moves by one, and the others stay.

    Solves  A_ff d_f = b_f - A_fc d_c  for any displacements d_c of the points, and any of them released, at
    the cost of one product with the dense matrix of the responses.

    - All points fixed: d = G d_c, with G_f = -A_ff^-1 A_fc and G_c the identity. Without springs the rows of
      G add up to 1: it holds weights of an average.
    - Some released: theirs follow from a dense system, S_rr d_r = (b_c - A_cf u)_r - S_rk d_k, with the Schur
      complement S = A_cc + A_cf G_f and u = A_ff^-1 b_f.
    - With a right-hand side b, u is added: one substitution with the factor, which is kept for it where
      `keep_factor` says so.

    G is held in float32: 4 n p bytes, 128 MB for 250,000 vertices and 128 points. Its rounding errors of
    6e-8 are averaged by the weights: heights are exact to about 1e-7 of the largest displacement. The
    factor that it is made with takes 1 kB for each vertex and is let go unless it is kept.

    Parameters
    ----------
    form : (n, n) sparse float64, CSR
        A; positive definite on the free vertices once the points are fixed.
    positions : (n, 3) float64
    index : (p,) int64
        The points.
    free : (n,) bool
        The vertices that are solved for, the points not among them; all others do not move.
    keep_factor : bool
        Allow for right-hand sides.
    tick : callable
        Called with the share that is done; may call the work off.

    Raises
    ------
    SolverError
        The system is singular or not positive definite.
    """

    def __init__(
        self,
        form: sp.csr_array,
        positions: NDArray[np.float64],
        index: NDArray[np.int64],
        free: NDArray[np.bool_],
        *,
        keep_factor: bool = False,
        tick: Tick = silent,
    ) -> None:
        self._count = len(positions)
        self._index = index
        self._point_rows = form[index]
        free_vertices = np.flatnonzero(free)
        rows = form[free_vertices]
        factor = Factor(rows[:, free_vertices].tocsr(), positions[free_vertices])
        # All that is dense keeps the order of the factor: sorting it would take as long as solving for it.
        self._free = free_vertices[factor.order]
        self._factor = factor if keep_factor else None
        self._weights = np.zeros((len(self._free), len(index)), dtype=np.float32)
        self._schur = self._point_rows[:, index].toarray()
        pulls = -rows[factor.order][:, index].tocsc()
        near = np.unique(pulls.indices)
        coupling = self._point_rows[:, self._free[near]]
        for start in range(0, len(index), _BLOCK):
            tick(start / len(index))
            block = slice(start, start + _BLOCK)
            solved = factor.solve_ordered(pulls[:, block].toarray(), overwrite=True)
            self._weights[:, block] = solved
            self._schur[:, block] += coupling @ solved[near]

    def displacement(
        self,
        moved: NDArray[np.float64],
        released: NDArray[np.bool_],
        pull: NDArray[np.float64] | None = None,
    ) -> NDArray[np.float64]:
        """Find the displacements of all vertices.

        Parameters
        ----------
        moved : (p,) float64
            Displacements of the points; those of released ones are not looked at.
        released : (p,) bool
            Points that are not held.
        pull : (n,) float64, optional
            The right-hand side b, for responses that keep their factor.

        Returns
        -------
        (n,) float64
        """
        points = np.where(released, 0.0, moved)
        result = np.zeros(self._count)
        pulled = np.zeros(len(points))
        if pull is not None and self._factor is not None:
            result[self._free] = self._factor.solve_ordered(pull[self._free])
            pulled = pull[self._index] - self._point_rows @ result
        with one_thread():
            if released.any():
                force = pulled - self._schur @ points
                points[released] = np.linalg.solve(self._schur[np.ix_(released, released)], force[released])
            result[self._free] += self._weights @ points.astype(np.float32)
        result[self._index] = points
        return result
