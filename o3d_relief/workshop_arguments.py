"""The words of the command line that send a solid to the mill or cut it into tiles."""

from __future__ import annotations

import argparse
import re
from pathlib import Path

from o3d_relief.errors import ParameterError
from o3d_relief.plate_params import PlateParams
from o3d_relief.workshop_params import MillParams, TileParams

__all__ = ["add_workshop", "check_workshop", "chosen_mill", "chosen_tiles", "wants_workshop"]

_SIZE = re.compile(r"([^xX]+)[xX]([^xX]+)$")


def _tile_size(text: str) -> tuple[float, float]:
    match = _SIZE.match(text)
    try:
        if match is None:
            raise ValueError
        return float(match[1]), float(match[2])
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"must be width x height in millimetres, such as 200x200. Got {text!r} instead."
        ) from None


def add_workshop(command: argparse.ArgumentParser) -> None:
    """Add the options for milling and tiles.

    Parameters
    ----------
    command : argparse.ArgumentParser
    """
    mill, tiles = MillParams(), TileParams(width_mm=1.0, height_mm=1.0)
    add = command.add_argument_group("milling", "the relief as a height field from the front").add_argument
    add("--undercut-free", action="store_true", help="fill everything below what is seen from the front")
    add("--height-map", type=Path, metavar="FILE.png",
        help="write the height field as 16 bit grey PNG or TIFF, too")  # fmt: skip
    add("--mm-per-pixel", type=float, metavar="MM",
        help=f"size of a pixel of the height field (default: {mill.mm_per_pixel:g})")  # fmt: skip
    add("--tool-mm", type=float, metavar="MM",
        help="diameter of the ball end tool: nothing finer, nothing that it cannot reach (default: no tool)",
    )  # fmt: skip
    add("--draft-deg", type=float, metavar="DEG", help="draft angle of all walls (default: none)")
    add("--keep-ridges", action="store_true", help="the tool fills hollows only, ridges stay sharp")

    add = command.add_argument_group("tiles", "for pieces larger than the printer").add_argument
    add("--tile", type=_tile_size, metavar="WxH",
        help="cut the piece into tiles of at most this size in mm: OUTPUT_1, OUTPUT_2, ... instead of OUTPUT",
    )  # fmt: skip
    add("--pin-mm", type=float, metavar="MM",
        help="diameter of the pins (default: half the plate's thickness, at most 6)")  # fmt: skip
    add("--clearance-mm", type=float, metavar="MM",
        help=f"space around a pin in its hole (default: {tiles.clearance_mm:g})")  # fmt: skip
    add("--no-tile-numbers", action="store_true", help="do not engrave the tiles' numbers into their backs")


def wants_workshop(options: argparse.Namespace) -> bool:
    """Tell whether anything was asked for that only a solid has: milling, tiles, a 3MF file.

    Parameters
    ----------
    options : argparse.Namespace
    """
    wanted = options.undercut_free or options.height_map is not None or options.tile is not None
    return bool(wanted or options.output.suffix.lower() == ".3mf")


def chosen_mill(options: argparse.Namespace) -> MillParams | None:
    """Return how to mill, None where no height field was asked for.

    Parameters
    ----------
    options : argparse.Namespace

    Raises
    ------
    ParameterError
        A value out of its range, or options of the mill without a height field.
    """
    given = {
        name: getattr(options, name)
        for name in ("mm_per_pixel", "tool_mm", "draft_deg")
        if getattr(options, name) is not None
    }
    if options.keep_ridges:
        given["keep_ridges"] = True
    if not options.undercut_free and options.height_map is None:
        for name in given:
            raise ParameterError(f"--{name.replace('_', '-')} needs --undercut-free or --height-map.")
        return None
    if options.keep_ridges and not options.tool_mm:
        raise ParameterError("--keep-ridges needs --tool-mm: without a tool nothing is rounded.")
    return MillParams(**given)


def chosen_tiles(options: argparse.Namespace) -> TileParams | None:
    """Return how to cut into tiles, None where none were asked for.

    Parameters
    ----------
    options : argparse.Namespace

    Raises
    ------
    ParameterError
        A value out of its range, or options of the tiles without tiles.
    """
    given = {
        name: getattr(options, name)
        for name in ("pin_mm", "clearance_mm")
        if getattr(options, name) is not None
    }
    if options.no_tile_numbers:
        given["number"] = False
    if options.tile is None:
        for name in ("pin_mm", "clearance_mm", "number"):
            if name in given:
                word = "no-tile-numbers" if name == "number" else name.replace("_", "-")
                raise ParameterError(f"--{word} needs --tile.")
        return None
    width, height = options.tile
    return TileParams(width_mm=width, height_mm=height, **given)


def check_workshop(plate: PlateParams | None, mill: MillParams | None, tiles: TileParams | None) -> None:
    """Check, before any long work, what does not depend on the relief.

    Parameters
    ----------
    plate : PlateParams or None
        None where no solid is made.
    mill : MillParams or None
    tiles : TileParams or None

    Raises
    ------
    ParameterError
        A tool or pixels wider than the piece, a plate too thin for the pins, tiles smaller than their pins.
    """
    if plate is None:
        return
    for name in ("tool_mm", "mm_per_pixel"):
        if mill is not None and getattr(mill, name) >= plate.width_mm:
            raise ParameterError(
                f"{name} must be smaller than the piece, which is {plate.width_mm:g} mm wide. "
                f"Got {getattr(mill, name):g} instead."
            )
    if tiles is not None:
        tiles.pin_for(plate.back_mm)
