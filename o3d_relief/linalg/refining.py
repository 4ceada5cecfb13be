"""A central path in a space of few unknowns, which is refined where that keeps the path from the minimum."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sla
from numpy.typing import NDArray

from o3d_relief.linalg.central_path import CentralPath
from o3d_relief.linalg.multigrid import multigrid
from o3d_relief.linalg.newton import Within
from o3d_relief.linalg.patches import Patches

__all__ = ["Refining"]

_LOOK_FROM = 0.2
"""Gap, as a share of the energy, from which on the forces tell where the space is too coarse."""

_MISSING = 0.35
"""Share of the accuracy that the space may cost in the end; the path itself comes down to 0.6."""

_MISSING_BEFORE = 0.1
"""Share of the gap that it may cost before."""

_LEFT = 0.3
"""Share of what may be missing that is left to the patches that are not split."""

_RIDGE = 1e-6
"""Share of its diagonal that is added to the form where it is solved with: the constraints hold what moves
freely."""

_ROUGH, _MOST_STEPS = 1e-2, 60


class Refining:
    """Takes the steps of a path from a space of displacements, and refines that.

    All constraints are those of the whole problem. Outside of the space the form is not in balance with the
    forces: with the rest r = pull - H (x - o) + forces the dual bound on the objective is lower by
    r' H^-1 r / 2, which is what the displacements that are missing may be worth.

    Parameters
    ----------
    path : CentralPath
    patches : Patches
        Span the space.
    """

    def __init__(self, path: CentralPath, patches: Patches) -> None:
        self._everywhere = path.newton
        self._path, self._patches = path, patches
        self._form = (path.form + sp.diags_array(_RIDGE * path.form.diagonal())).tocsr()
        self._cycle = multigrid(self._form)
        self._more = 1.0  # what the space costs, as a multiple of what single vertices tell
        self._enter()

    def settled(self, share: float, accuracy: float) -> bool:
        """Tell whether the space is good enough by now, as far as single vertices tell; else refine it.

        Parameters
        ----------
        share : float
            The gap within the space, as a share of the energy.
        accuracy : float
            What gap and cost may be in the end, as a share, too.

        Returns
        -------
        bool
            Whether gap and cost together may be below `accuracy`.
        """
        if share > _LOOK_FROM:
            return False
        path = self._path
        # Rows that have just come are held by forces that are none of the minimum's.
        rest, energy = path.imbalance(~path.lacking), path.energy(path.x)
        local = self._more * self._local(rest)
        missing = float(local.sum()) / energy
        allowed = max(_MISSING * accuracy, _MISSING_BEFORE * share)
        if missing > allowed:
            self._patches.split(local, _LEFT * allowed * energy)
            self._enter()
        return missing <= min(allowed, accuracy - share)

    def cost(self) -> float:
        """Return by how much the space lowers the dual bound on the objective."""
        rest = self._path.imbalance(np.ones(len(self._path.lack), dtype=bool))
        moved, _ = sla.cg(self._form, rest, rtol=_ROUGH, atol=0.0, maxiter=_MOST_STEPS, M=self._cycle)
        cost, local = 0.5 * float(rest @ moved), float(self._local(rest).sum())
        if local > 0.0 and not self._path.lacking.any():
            self._more = max(self._more, cost / local)
        return cost

    def leave(self) -> None:
        """Take the next steps from the space of all displacements."""
        self._path.newton = self._everywhere

    def _local(self, rest: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return what each vertex alone could gain outside of the space, (n,)."""
        # What lies in the space comes into balance by itself, with the steps.
        outside = rest - self._maps @ (self._maps.T @ rest)
        return np.asarray(0.5 * outside**2 / self._form.diagonal())

    def _enter(self) -> None:
        self._maps = self._patches.maps()
        self._path.newton = Within(self._path.form, self._maps)
