"""What a run tells the process of the stage viewer, beside its records."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from o3d_relief.params import Triple

__all__ = ["Done", "Opening"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Opening:
    """The first message.

    Attributes
    ----------
    viewpoint : three floats or None
        In relief units.
    colors : (n_in, 3) float64 or None
        sRGB colours of the input vertices.
    title : str
        Of the window.
    size : (width, height)
        Of the window, in pixels.
    """

    viewpoint: Triple | None
    colors: NDArray[np.float64] | None
    title: str
    size: tuple[int, int]


@dataclass(frozen=True)
class Done:
    """The last message: the window stays open though nothing more will come."""
