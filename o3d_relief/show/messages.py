"""What the processes of the windows are told, beside the records of the stages."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from o3d_relief.params import ReliefParams, Triple, View
from o3d_relief.scene.arrays import MeshArrays

__all__ = ["Done", "EditorOpening", "Opening"]


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


@dataclass(frozen=True, kw_only=True, eq=False)
class EditorOpening:
    """All that the process of the live editor is told.

    Attributes
    ----------
    scene : MeshArrays
    params : ReliefParams
    view : View
    output : Path or None
        Where "Save relief" writes to.
    size_mm : float
        Length of the relief's larger side in millimetres.
    title : str
        Of the window.
    size : (width, height)
        Of the window, in pixels.
    result : Path
        The parameter file to leave behind.
    """

    scene: MeshArrays
    params: ReliefParams
    view: View
    output: Path | None
    size_mm: float
    title: str
    size: tuple[int, int]
    result: Path
