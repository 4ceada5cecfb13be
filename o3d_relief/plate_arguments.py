"""The words of the command line for the plate under a solid."""

from __future__ import annotations

import argparse
from pathlib import Path

from o3d_relief.errors import ParameterError
from o3d_relief.plate_params import HANGINGS, LOOSE, PRINT_DIRECTIONS, SHAPES, PlateParams
from o3d_relief.workshop_arguments import wants_workshop

__all__ = ["add_plate", "chosen_plate"]


def add_plate(command: argparse.ArgumentParser) -> None:
    """Add the options of the plate.

    Parameters
    ----------
    command : argparse.ArgumentParser
    """
    default = PlateParams()
    group = command.add_argument_group(
        "solid", "lengths in millimetres; any of these makes a closed body of relief and plate"
    )
    for name, text in (
        ("width_mm", "width of the whole object"),
        ("depth_mm", "depth of the whole object, base included (default: in proportion)"),
        ("base_mm", "thickness of the plate"),
        ("margin_mm", "from the relief to the frame or the plate's edge"),
        ("frame_mm", "width of a rim around the plate"),
        ("frame_height_mm", "height of the rim (default: its width)"),
        ("embed_mm", "how far the relief reaches into the plate"),
        ("thickness_mm", "thickness given to surfaces that have none"),
        ("min_wall_mm", "report walls that are thinner"),
        ("nozzle_mm", "width of the printer's line"),
        ("magnet_mm", "diameter of the magnets"),
        ("magnet_height_mm", "thickness of the magnets"),
    ):
        value = getattr(default, name)
        group.add_argument(f"--{name.replace('_', '-')}", type=float, metavar="MM",
                           help=text if value is None else f"{text} (default: {value:g})")  # fmt: skip
    for name, choices, text in (
        ("shape", SHAPES, "of the plate"),
        ("hanging", HANGINGS, "in the plate's back"),
        ("loose", LOOSE, "what becomes of parts that touch nothing"),
        ("print_direction", PRINT_DIRECTIONS, "what is up in print: z for lying on the back"),
    ):
        group.add_argument(f"--{name.replace('_', '-')}", choices=choices,
                           help=f"{text} (default: {getattr(default, name)})")  # fmt: skip
    group.add_argument("--overhang-degrees", type=float, metavar="A",
                       help=f"faces that lean out further need support "
                            f"(default: {default.overhang_degrees:g})")  # fmt: skip
    group.add_argument("--thicken", action="store_const", const=True,
                       help="make walls thinner than --min-wall-mm thicker, at their back")  # fmt: skip
    group.add_argument("--walls", type=Path, metavar="FILE.png", help="draw the wall thickness as heat")


def chosen_plate(options: argparse.Namespace) -> PlateParams | None:
    """Return the plate that was asked for, None where none was.

    Parameters
    ----------
    options : argparse.Namespace
        Of the command "make".

    Raises
    ------
    ParameterError
        A value out of its range, or a depth that was asked for twice.
    """
    given = {name: getattr(options, name) for name in PlateParams.__dataclass_fields__}
    given = {name: value for name, value in given.items() if value is not None}
    if not given and options.walls is None and not wants_workshop(options):
        return None
    for name in ("alpha", "depth"):
        if "depth_mm" in given and getattr(options, name) is not None:
            raise ParameterError(f"--depth-mm and --{name} exclude each other: give one of them.")
    return PlateParams(**given)
