"""How what the editor's widgets say becomes parameters, and back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from o3d_relief.params import ReliefParams
from o3d_relief.scene.frame import RELIEF_UNITS

__all__ = ["MODES", "Scale", "mode_of", "mode_values"]

MODES: Mapping[str, str] = {
    "alpha": "attenuation, compressed by alpha",
    "depth": "attenuation, compressed to the depth",
    "bounded": "bounded: the closest of the depth",
}
"""What the relief can be made by, and the words for it."""


@dataclass(frozen=True, kw_only=True)
class Scale:
    """Between the input's unit and the millimetres of the finished piece.

    Attributes
    ----------
    unit : float
        Length of one relief unit in the input's unit.
    size_mm : float
        Length of the relief's larger side.

    Examples
    --------
    >>> scale = Scale(unit=0.02, size_mm=150.0)
    >>> round(scale.to_mm(1.0), 9), round(scale.to_input(75.0), 9)
    (75.0, 1.0)
    """

    unit: float
    size_mm: float

    def to_mm(self, length: float) -> float:
        """Return the millimetres of a length in the input's unit."""
        return length / (RELIEF_UNITS * self.unit) * self.size_mm

    def to_input(self, length_mm: float) -> float:
        """Return the length in the input's unit of millimetres."""
        return length_mm / self.size_mm * RELIEF_UNITS * self.unit


def mode_of(params: ReliefParams) -> str:
    """Return the key of `MODES` that parameters stand for.

    Examples
    --------
    >>> mode_of(ReliefParams()), mode_of(ReliefParams(depth=3))
    ('alpha', 'bounded')
    >>> mode_of(ReliefParams(depth=3, mode="attenuation"))
    'depth'
    """
    if params.bounded:
        return "bounded"
    return "alpha" if params.depth is None else "depth"


def mode_values(mode: str, depth: float, alpha: float) -> dict[str, Any]:
    """Return the parameters to change for a mode.

    Parameters
    ----------
    mode : str
        A key of `MODES`.
    depth : float
        In the input's unit; for the modes that have one.
    alpha : float
        For the mode without a depth; 1 is no compression.
    """
    if mode == "alpha":
        return {"mode": None, "depth": None, "alpha": alpha if alpha < 1.0 else None}
    values: dict[str, Any] = {"mode": "attenuation", "depth": depth, "alpha": None, "alpha_min": None}
    if mode == "bounded":
        values |= {"mode": "bounded", "in_front": True, "in_order": True}
    return values
