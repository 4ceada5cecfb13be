"""Range compression and exact depth (section 3.3)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["alpha_for_depth", "compress"]


def compress(
    z: NDArray[np.float64], *, alpha: float, alpha_min: float | None = None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Compress the relief distances, those near S more than those far from it.

    The range of the relief distances is mapped linearly onto [alpha_min, alpha], and each distance is
    multiplied by its ratio. Vertices behind S are trimmed anyway: they take alpha_min, and where there
    are any, the range starts at S, where the cut will be. The order of the distances is kept.

    Parameters
    ----------
    z : (n,) float64
        Relief distances, negative behind S.
    alpha : float
        The paper's alpha_max, the ratio of the furthest vertex.
    alpha_min : float, optional
        The ratio of the nearest vertex; half of `alpha` where omitted.

    Returns
    -------
    ratio : (n,) float64
        alpha_i.
    z : (n,) float64
        alpha_i z_i.

    Examples
    --------
    >>> compress(np.array([0.0, 5, 10]), alpha=0.8)[1].round(6).tolist()
    [0.0, 3.0, 8.0]
    """
    lowest_ratio = alpha / 2.0 if alpha_min is None else alpha_min
    low, high = max(float(z.min()), 0.0), float(z.max())
    span = high - low
    share = np.clip((z - low) / span, 0.0, 1.0) if span > 0.0 else np.ones(len(z))
    ratio = lowest_ratio + (alpha - lowest_ratio) * share
    return ratio, ratio * z


def alpha_for_depth(z: NDArray[np.float64], depth: float) -> float:
    """Find the alpha with which the compressed relief is exactly `depth` deep.

    The furthest vertex has the ratio alpha whatever alpha_min is, so that the depth is alpha times the
    depth before.

    Parameters
    ----------
    z : (n,) float64
        Relief distances.
    depth : float
        Wanted largest distance, positive, in the unit of `z`.

    Returns
    -------
    float
        At most 1: a relief that is shallower already is not stretched.

    Examples
    --------
    >>> alpha_for_depth(np.array([0.0, 20.0]), 5.0)
    0.25
    """
    highest = float(z.max())
    return min(1.0, depth / highest) if highest > 0.0 else 1.0
