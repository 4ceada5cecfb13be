"""What several encoders need."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["color_bytes", "to_picture", "unique_rows"]


def color_bytes(colors: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Turn colours (n, 3) from 0 to 1 into bytes."""
    return np.rint(255.0 * np.clip(colors, 0.0, 1.0)).astype(np.uint8)


def to_picture(texture: NDArray[np.uint8]) -> Any:
    """Make a picture of a texture, the top row first."""
    from PIL import Image

    return Image.fromarray(np.ascontiguousarray(texture[::-1]))


def unique_rows(pairs: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return the different rows of pairs (p, 2) and, for each row, which of them it is (p,)."""
    values, index = np.unique(np.ascontiguousarray(pairs).view(np.complex128).ravel(), return_inverse=True)
    return values.view(np.float64).reshape(-1, 2), index.ravel()
