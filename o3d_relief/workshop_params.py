"""What the workshop can do: the tool of the mill, the bed of the printer."""

from __future__ import annotations

import math
from dataclasses import dataclass

from o3d_relief.errors import ParameterError
from o3d_relief.param_checks import check_positive, check_range

__all__ = ["PIN_WALL", "MillParams", "TileParams"]

PIN_WALL = 0.6
"""Millimetres of material that stay around the hole of a pin."""


@dataclass(frozen=True, kw_only=True)
class MillParams:
    """How a relief is milled: from the front, along z, with one ball end tool.

    Parameters
    ----------
    mm_per_pixel : float
        Distance between two samples of the height field, along x and y. Nothing finer is kept.
    tool_mm : float
        Diameter of the ball end tool. Hollows that it cannot enter are filled, ridges and points that are
        sharper than its tip are rounded. 0: no tool, the height field as it is.
    draft_deg : float
        Draft angle: no wall is steeper than 90 degrees minus this, the foot of a steeper one is filled.
        0: vertical walls stay.
    keep_ridges : bool
        Do not round ridges and points: the tool can leave them sharp, but thin ones may break.

    Raises
    ------
    ParameterError
        A value out of its range, or a tool that is finer than a pixel.

    Examples
    --------
    >>> MillParams(tool_mm=3).tool_mm
    3.0
    """

    mm_per_pixel: float = 0.2
    tool_mm: float = 0.0
    draft_deg: float = 0.0
    keep_ridges: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "mm_per_pixel", check_positive("mm_per_pixel", self.mm_per_pixel))
        object.__setattr__(self, "tool_mm", check_range("tool_mm", self.tool_mm, 0.0))
        object.__setattr__(self, "draft_deg", check_range("draft_deg", self.draft_deg, 0.0, 60.0))
        if not isinstance(self.keep_ridges, bool):
            raise ParameterError(f"keep_ridges must be True or False. Got {self.keep_ridges!r} instead.")
        if 0.0 < self.tool_mm < 2.0 * self.mm_per_pixel:
            raise ParameterError(
                f"tool_mm must be at least two pixels ({2.0 * self.mm_per_pixel:g} mm), or 0 for no tool. "
                f"Got {self.tool_mm:g} instead: make mm_per_pixel smaller."
            )


@dataclass(frozen=True, kw_only=True)
class TileParams:
    """How a solid is cut into tiles that are printed one by one and put together with pins.

    Parameters
    ----------
    width_mm, height_mm : float
        Largest size of a tile along x and y, its pins included.
    pin_mm : float, optional
        Diameter of the pins. None: half of the plate's thickness, at most 6.
    pin_length_mm : float, optional
        How far a pin stands out. None: one and a half times its diameter.
    clearance_mm : float
        Space between a pin and its hole, all around and at the end.
    number : bool
        Engrave the number of each tile into its back.

    Raises
    ------
    ParameterError
        A value out of its range, or tiles smaller than a pin.

    Examples
    --------
    >>> TileParams(width_mm=200, height_mm=200).clearance_mm
    0.2
    """

    width_mm: float
    height_mm: float
    pin_mm: float | None = None
    pin_length_mm: float | None = None
    clearance_mm: float = 0.2
    number: bool = True

    def __post_init__(self) -> None:
        for name in ("width_mm", "height_mm", "pin_mm", "pin_length_mm"):
            value = getattr(self, name)
            if value is not None:
                whose = "" if name.startswith("pin") else "The tile's "
                object.__setattr__(self, name, check_positive(f"{whose}{name}", value))
        object.__setattr__(self, "clearance_mm", check_range("clearance_mm", self.clearance_mm, 0.0, 2.0))
        if not isinstance(self.number, bool):
            raise ParameterError(f"number must be True or False. Got {self.number!r} instead.")
        if self.pin_mm is not None:
            self.check_room(self.pin_mm, self.length_of(self.pin_mm))

    def pin_for(self, base_mm: float) -> float:
        """Return the diameter of the pins for a plate of this thickness (0 for none), in millimetres.

        Raises
        ------
        ParameterError
            A plate too thin for them, or a tile too small.
        """
        pin = self.pin_mm
        if pin is None:
            pin = min(6.0, base_mm / 2.0) if base_mm > 0.0 else 3.0
        needed = pin + 2.0 * (self.clearance_mm + PIN_WALL)
        if 0.0 < base_mm < needed - 1e-9:
            raise ParameterError(
                f"The plate must be at least {needed:g} mm thick for pins of {pin:g} mm. "
                f"Got {base_mm:g} instead: make base_mm larger or pin_mm smaller."
            )
        self.check_room(pin, self.length_of(pin))
        return pin

    def length_of(self, pin_mm: float) -> float:
        """Return how far a pin of this diameter stands out, in millimetres."""
        return 1.5 * pin_mm if self.pin_length_mm is None else self.pin_length_mm

    def check_room(self, pin_mm: float, length_mm: float) -> None:
        """Check that a tile is larger than its pins.

        Raises
        ------
        ParameterError
            A tile that has no room for a pin on one side and a hole on the other.
        """
        needed = max(4.0 * pin_mm, 3.0 * length_mm + 2.0 * self.clearance_mm)
        for name in ("width_mm", "height_mm"):
            if getattr(self, name) < needed:
                raise ParameterError(
                    f"The tile's {name} must be at least {math.ceil(10.0 * needed) / 10.0:g} for pins of "
                    f"{pin_mm:g} mm that stand out {length_mm:g} mm. Got {getattr(self, name):g} instead."
                )
