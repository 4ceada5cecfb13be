"""Linear scaling: the affine relief, the "generalised bas-relief" of a single factor."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["linear_scaling"]


def linear_scaling(z: NDArray[np.float64], visible: NDArray[np.bool_], depth: float) -> NDArray[np.float64]:
    """Scale all heights by one factor.

    Belhumeur, Kriegman, Yuille, "The Bas-Relief Ambiguity", 1997, with mu = nu = 0: z' = lambda z. From the
    front, and in the light that is turned to suit, it cannot be told from the scene.

    Parameters
    ----------
    z : (n,) float64
    visible : (n,) bool
    depth : float
        Visible depth of the relief.

    Returns
    -------
    (n,) float64

    Examples
    --------
    >>> linear_scaling(np.array([1.0, 2, 5]), np.array([False, True, True]), 6.0).tolist()
    [-2.0, 0.0, 6.0]
    """
    low, high = z[visible].min(), z[visible].max()
    return np.asarray((z - low) * (depth / (high - low)))
