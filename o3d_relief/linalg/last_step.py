"""The last step of a path that went through a space of patches: all unknowns, one by one."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from o3d_relief.linalg.central_path import CentralPath

__all__ = ["last_step"]

Vector = NDArray[np.float64]

_TRIES = 20
"""Looks at what the step would need further; a bust of 134,000 vertices takes two."""


def last_step(
    path: CentralPath,
    accepted: Vector,
    more_rows: Callable[[Vector], tuple[sp.csr_array, Vector]],
    least_gap: float,
) -> Vector:
    """Take one step in which every unknown moves on its own, where all stays well.

    What is left of the borders of patches shows as fine ridges; it is rough, and goes with one step. Further
    rows that this would need are few: the unknowns in them go back to where they were.

    Parameters
    ----------
    path : CentralPath
        Its steps are taken from the space of all displacements by now.
    accepted : (n,) float64
        An x with which all is well.
    more_rows : callable
        See `minimise`.
    least_gap : float
        See `CentralPath.advance`.

    Returns
    -------
    (n,) float64
        An x with which all is well, and no worse than `accepted`.
    """
    path.advance(least_gap)
    back = np.zeros(len(accepted), dtype=bool)
    for _ in range(_TRIES):
        x = _with_known_rows(path, accepted, back)
        wrong, _ = more_rows(x)
        if wrong.shape[0] == 0:
            return x if path.objective(x) <= path.objective(accepted) else accepted
        known = int(back.sum())
        back[wrong.indices] = True
        if int(back.sum()) == known:  # what more_rows looks at has moved as a whole
            break
    return accepted


def _with_known_rows(path: CentralPath, accepted: Vector, back: NDArray[np.bool_]) -> Vector:
    """Send back what known rows need, further and further; `back` grows, so that this comes to an end."""
    while True:
        x = np.where(back, accepted, path.x)
        wrong = path.broken(x, accepted)
        if wrong.shape[0] == 0:
            return np.asarray(x)
        back[wrong.indices] = True
