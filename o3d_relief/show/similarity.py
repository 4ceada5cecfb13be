"""Structural similarity of two pictures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from o3d_relief.errors import ReliefError

__all__ = ["Picture", "similarity"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Picture:
    """A grey picture, 0 to 255, and what of it is covered by the subject: (height, width) each."""

    pixels: NDArray[np.float64]
    covered: NDArray[np.bool_]


def similarity(one: Picture, other: Picture) -> float:
    """Return the mean structural similarity (SSIM) over the pixels that either subject covers.

    With the Gaussian weights (sigma 1.5) and the constants of Wang, Bovik, Sheikh, Simoncelli, "Image Quality
    Assessment: From Error Visibility to Structural Similarity", 2004. The background is alike in all pictures
    and would only raise the mean.

    Raises
    ------
    ReliefError
        scikit-image is not installed.
    """
    try:
        from skimage.metrics import structural_similarity
    except ImportError:
        raise ReliefError("Similarity needs scikit-image: pip install scikit-image.") from None
    _, local = structural_similarity(
        one.pixels,
        other.pixels,
        data_range=255.0,
        gaussian_weights=True,
        sigma=1.5,
        use_sample_covariance=False,
        full=True,
    )
    return float(local[one.covered | other.covered].mean())
