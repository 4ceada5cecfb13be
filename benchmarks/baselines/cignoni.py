"""Non-linear depth compression after Cignoni, Montani and Scopigno."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["depth_compression"]


def depth_compression(
    z: NDArray[np.float64], visible: NDArray[np.bool_], depth: float, *, distance: float = 100.0
) -> NDArray[np.float64]:
    """Compress heights as the perspective transformation of a camera does.

    P. Cignoni, C. Montani, R. Scopigno, "Computer-assisted generation of bas- and high-reliefs", Journal of
    Graphics Tools 2(3), 1997, section 2, relate the elevations in a relief to the perspective
    transformation of classical computer graphics. What lies at the distance t behind the nearest visible
    point goes to t / (distance + t), the hyperbola by which that transformation stores depths: parts near
    the viewer keep most of their depth, far ones lose most. Linear scaling to the wanted depth follows.

    The publication applies it after the projection of a finite viewer. Here the viewer of the picture is
    infinitely far, so that x and y stay, as with all other methods that are compared.

    Parameters
    ----------
    z : (n,) float64
    visible : (n,) bool
    depth : float
        Visible depth of the relief.
    distance : float
        Of the viewer to the nearest visible point, positive; linear scaling where infinite.

    Returns
    -------
    (n,) float64

    Examples
    --------
    >>> z = depth_compression(np.array([0.0, 5, 10]), np.ones(3, dtype=bool), 3.0, distance=10.0)
    >>> z.round(12).tolist()
    [0.0, 1.0, 3.0]
    """
    behind_front = z[visible].max() - z
    # What is hidden in front of all visible points does not exist, but for rounding.
    compressed = behind_front / (1.0 + np.maximum(behind_front, 0.0) / distance)
    deepest = compressed[visible].max()
    return np.asarray(depth * (1.0 - compressed / deepest))
