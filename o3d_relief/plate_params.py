"""What the user chooses of the solid: its sizes in millimetres, the plate's shape, how it hangs."""

from __future__ import annotations

from dataclasses import dataclass

from o3d_relief.errors import ParameterError
from o3d_relief.param_checks import check_number, check_range

__all__ = ["HANGINGS", "LOOSE", "PRINT_DIRECTIONS", "SHAPES", "PlateParams"]

SHAPES = ("rectangle", "ellipse", "contour", "none")
HANGINGS = ("none", "keyhole", "magnets")
LOOSE = ("report", "bridge", "remove")
PRINT_DIRECTIONS = ("x", "y", "z")

_KEYHOLE_DEPTH = 3.8
"""Millimetres from the back: a lip of 1.5 and room of 2.3 for the head of a screw."""
_LARGEST = 10_000.0
"""Millimetres. Ten metres: more than that is a slip of the pen."""


@dataclass(frozen=True, kw_only=True)
class PlateParams:
    """Sizes and shape of the solid that a relief becomes; all lengths in millimetres.

    Parameters
    ----------
    width_mm : float
        Width of the whole object, from the plate's left edge to its right one.
    depth_mm : float, optional
        Depth of the whole object, from its back to its highest point. None: as deep as the relief is in
        proportion to its width, and the base.
    base_mm : float
        Thickness of the plate.
    margin_mm : float
        From the relief's extents (its outline, for "contour") to the frame or to the plate's edge.
    shape : str
        "rectangle", "ellipse", "contour" (follows the relief's outline), or "none": the relief alone,
        its back in the relief plane.
    frame_mm : float
        Width of a rim around the plate; 0 for none.
    frame_height_mm : float, optional
        Its height above the plate; None: as high as it is wide.
    embed_mm : float
        How far the relief reaches down into the plate, which holds it.
    thickness_mm : float
        Thickness given to surfaces that have none.
    min_wall_mm : float
        Walls thinner than this are reported.
    thicken : bool
        Also make them thicker, at their back. Sharp edges stay thinner.
    nozzle_mm : float
        Width of the line that the printer lays; no wall can be thinner.
    hanging : str
        "none", or in the back a "keyhole" (for the head of a screw, up to 8 mm) or "magnets" (pockets for
        round ones).
    magnet_mm, magnet_height_mm : float
        Diameter and thickness of the magnets; the pockets have 0.2 mm of play.
    loose : str
        What becomes of parts that touch nothing: "report" keeps them and says so, "bridge" ties each to
        what lies behind it with a pin, "remove" leaves them out.

    print_direction : str
        "z" prints the object lying on its back, "y" standing, "x" on its left edge: up, in print.
    overhang_degrees : float
        Faces that lean out further than this from the vertical need support.

    Raises
    ------
    ParameterError
        A value out of its range, or sizes that contradict each other.

    Examples
    --------
    >>> PlateParams(width_mm=150, depth_mm=25, base_mm=4).shape
    'rectangle'
    """

    width_mm: float = 150.0
    depth_mm: float | None = None
    base_mm: float = 4.0
    margin_mm: float = 6.0
    shape: str = "rectangle"
    frame_mm: float = 0.0
    frame_height_mm: float | None = None
    embed_mm: float = 1.0
    thickness_mm: float = 1.2
    min_wall_mm: float = 0.8
    thicken: bool = False
    nozzle_mm: float = 0.4
    hanging: str = "none"
    magnet_mm: float = 10.0
    magnet_height_mm: float = 2.0
    loose: str = "report"
    print_direction: str = "z"
    overhang_degrees: float = 45.0

    def __post_init__(self) -> None:
        for name, choices in (
            ("shape", SHAPES),
            ("hanging", HANGINGS),
            ("loose", LOOSE),
            ("print_direction", PRINT_DIRECTIONS),
        ):
            value = getattr(self, name)
            if value not in choices:
                raise ParameterError(f"{name} must be one of {', '.join(choices)}. Got {value!r} instead.")
        if not isinstance(self.thicken, bool):
            raise ParameterError(f"thicken must be True or False. Got {self.thicken!r} instead.")
        positive = ("width_mm", "depth_mm", "base_mm", "embed_mm", "thickness_mm", "min_wall_mm")
        for name in (*positive, "nozzle_mm", "magnet_mm", "magnet_height_mm", "frame_height_mm"):
            value = getattr(self, name)
            if value is None and name in ("depth_mm", "frame_height_mm"):
                continue
            number = check_number(name, value)
            if not 0.0 < number <= _LARGEST:
                wanted = "greater than 0" if number <= 0.0 else f"at most {_LARGEST:g}"
                raise ParameterError(f"{name} must be {wanted} (millimetres). Got {value!r} instead.")
            object.__setattr__(self, name, number)
        for name in ("margin_mm", "frame_mm"):
            object.__setattr__(self, name, check_range(name, getattr(self, name), 0.0, _LARGEST))
        degrees = check_range("overhang_degrees", self.overhang_degrees, 0.0, 90.0)
        object.__setattr__(self, "overhang_degrees", degrees)
        self._check_together()

    def _check_together(self) -> None:
        for name in ("min_wall_mm", "thickness_mm"):
            if getattr(self, name) < self.nozzle_mm:
                raise ParameterError(
                    f"{name} must be at least nozzle_mm, {self.nozzle_mm:g}: a nozzle cannot print less. "
                    f"Got {getattr(self, name):g} instead."
                )
        edge = self.edge_mm
        if 2.0 * edge >= self.width_mm:
            raise ParameterError(
                f"width_mm must be greater than twice margin_mm and frame_mm together, {2.0 * edge:g}: "
                f"nothing is left for the relief. Got {self.width_mm:g} instead."
            )
        if self.shape == "none":
            if self.hanging != "none":
                raise ParameterError(
                    f"hanging={self.hanging!r} needs a plate: choose another shape than 'none'."
                )
            return
        if self.base_mm < self.min_wall_mm:
            raise ParameterError(
                f"base_mm must be at least min_wall_mm, {self.min_wall_mm:g}. Got {self.base_mm:g} instead."
            )
        if self.depth_mm is not None and self.base_mm >= self.depth_mm:
            raise ParameterError(
                f"base_mm must be less than depth_mm, {self.depth_mm:g}, the depth of the whole object. "
                f"Got {self.base_mm:g} instead."
            )
        frame = self.frame_mm if self.frame_height_mm is None else self.frame_height_mm
        if self.frame_mm > 0.0 and self.depth_mm is not None and self.base_mm + frame > self.depth_mm:
            raise ParameterError(
                f"base_mm and frame_height_mm together, {self.base_mm + frame:g}, must not exceed depth_mm, "
                f"{self.depth_mm:g}."
            )
        if self.embed_mm >= self.base_mm:
            raise ParameterError(
                f"embed_mm must be less than base_mm, {self.base_mm:g}. Got {self.embed_mm:g} instead."
            )
        least = self.pocket_mm + self.min_wall_mm
        if self.hanging != "none" and least > self.base_mm:
            raise ParameterError(
                f"base_mm must be at least {least:g} for hanging={self.hanging!r}. "
                f"Got {self.base_mm:g} instead."
            )

    @property
    def edge_mm(self) -> float:
        """From the relief to the edge of the object: margin and frame; 0 without a plate."""
        return 0.0 if self.shape == "none" else self.margin_mm + self.frame_mm

    @property
    def back_mm(self) -> float:
        """How far the back lies behind the relief plane: the base; 0 without a plate."""
        return 0.0 if self.shape == "none" else self.base_mm

    @property
    def pocket_mm(self) -> float:
        """Depth of the pockets in the back, 0 for none."""
        return {"none": 0.0, "keyhole": _KEYHOLE_DEPTH, "magnets": self.magnet_height_mm + 0.2}[self.hanging]
