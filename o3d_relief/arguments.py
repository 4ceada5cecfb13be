"""The words of the command line."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NoReturn

from o3d_relief import __version__
from o3d_relief.batch_arguments import add_batch
from o3d_relief.errors import ParameterError
from o3d_relief.limits import MAX_TRIANGLES
from o3d_relief.params import ReliefParams, View
from o3d_relief.params_file import field_values, load_params
from o3d_relief.plate_params import HANGINGS, LOOSE, PRINT_DIRECTIONS, SHAPES, PlateParams
from o3d_relief.scan_arguments import add_scan
from o3d_relief.window_arguments import add_windows
from o3d_relief.workshop_arguments import add_workshop, wants_workshop

__all__ = ["chosen_params", "chosen_plate", "chosen_view", "parse"]

_POINTS = ("--front", "--up", "--viewpoint", "--vanishing-point", "--sensor")
_FORMATS = "PLY, OBJ, STL, OFF, GLB, glTF, PCD, XYZ, PTS, LAS or LAZ"
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?$")
_AXIS = re.compile(r"[+-]?[xyzXYZ]$")


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Understand the words after the program's name.

    Parameters
    ----------
    arguments : sequence of str

    Returns
    -------
    argparse.Namespace
        With the name of the command in `command`. Help, version and words that are not understood end the
        program, the last with one sentence and exit code 2. What a parameter file says takes the place
        of the defaults.

    Raises
    ------
    ReliefError
        A parameter file that cannot be used.
    """
    words = _join_points(list(arguments))
    options = _parser({}).parse_args(words)
    if getattr(options, "params", None) is None:
        return options
    params, view = load_params(options.params)
    return _parser(field_values(params) | field_values(view)).parse_args(words)


class _Parser(argparse.ArgumentParser):
    """A parser that says what is wrong in one sentence."""

    def error(self, message: str) -> NoReturn:
        sys.stderr.write(f"{self.prog}: error: {message} (see {self.prog} --help)\n")
        raise SystemExit(2)


def _join_points(arguments: list[str]) -> list[str]:
    """Join '--front -y', '--front 0 -1 0' and '--front -1,0,0' to one word, which argparse needs."""
    joined = []
    position = 0
    while position < len(arguments):
        word = arguments[position]
        following = arguments[position + 1 : position + 4]
        position += 1
        if word in _POINTS and following:
            if len(following) == 3 and all(_NUMBER.match(item) for item in following):
                word, position = f"{word}={','.join(following)}", position + 3
            elif _AXIS.match(following[0]) or "," in following[0]:
                word, position = f"{word}={following[0]}", position + 1
        joined.append(word)
    return joined


def _numbers(text: str) -> tuple[float, ...]:
    try:
        return tuple(float(item) for item in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"must be numbers with commas between them. Got {text!r} instead."
        ) from None


def _integers(text: str) -> tuple[int, ...]:
    try:
        return tuple(int(item) for item in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"must be whole numbers with commas between them. Got {text!r} instead."
        ) from None


def _point(text: str) -> tuple[float, ...]:
    numbers = _numbers(text)
    if len(numbers) != 3:
        raise argparse.ArgumentTypeError(f"must be three numbers. Got {text!r} instead.")
    return numbers


def _direction(text: str) -> str | tuple[float, ...]:
    if _AXIS.match(text):
        return text
    try:
        return _point(text)
    except argparse.ArgumentTypeError:
        raise argparse.ArgumentTypeError(
            f"must be x, -x, y, -y, z, -z or three numbers. Got {text!r} instead."
        ) from None


def _beta(text: str) -> float | tuple[float, ...]:
    numbers = _numbers(text)
    return numbers[0] if len(numbers) == 1 else numbers


def _parser(replaced: dict[str, Any]) -> argparse.ArgumentParser:
    """Build the parser; `replaced` holds values in place of the defaults of the commands."""
    parser = _Parser(prog="o3d-relief", description="Make high reliefs from 3D scenes.", allow_abbrev=False)
    parser.add_argument("--version", action="version", version=f"o3d-relief {__version__}")
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND", dest="command")

    make = commands.add_parser(
        "make",
        help="make a relief of a mesh or of a point cloud",
        description="Make a relief of a mesh file, or of a point cloud, which is meshed first.",
    )
    make.add_argument("input", type=Path, metavar="INPUT", help=f"{_FORMATS} file")
    make.add_argument("output", type=Path, metavar="OUTPUT", help="PLY, OBJ, STL or GLB file; 3MF for solids")
    _add_view(make)
    _add_params(make)
    add_scan(make, _point)
    _add_plate(make)
    add_workshop(make)
    make.add_argument(
        "--report", type=Path, metavar="FILE.json", help="write parameters, counts, times and depths"
    )
    make.add_argument("--stages", type=Path, metavar="DIR", help="write a picture of each stage")
    make.add_argument(
        "--strict", action="store_true",
        help="refuse a relief that does not keep what the certificate tests, and a solid that fails the "
        "print checks; end with 3 where these only warn",
    )  # fmt: skip
    make.add_argument(
        "--dry-run", action="store_true", help="only tell sizes, volume, triangles and memory in advance"
    )

    _add_limit(make)
    make.set_defaults(**replaced)

    many = commands.add_parser(
        "batch",
        help="make reliefs of many files at once",
        description="Make a relief of each of many meshes and point clouds, on all cores or on a cluster. "
        "After an interruption the same command goes on where it was.",
    )
    add_batch(many)
    _add_view(many)
    _add_params(many)
    add_scan(many, _point)
    many.set_defaults(**replaced)

    shared = [_add_view, _add_params, lambda command: add_scan(command, _point), _add_limit]
    add_windows(commands, _FORMATS, shared, replaced)

    demo = commands.add_parser(
        "demo",
        help="make a relief of the built-in scene, with pictures",
        description="Make a relief of the built-in scene, with a picture of each stage and a sheet of views.",
    )
    demo.add_argument(
        "directory",
        type=Path,
        nargs="?",
        default=Path("relief-demo"),
        metavar="DIR",
        help="default: %(default)s",
    )
    return parser


def _add_limit(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "--max-triangles", type=int, metavar="N", help=f"refuse larger meshes (default: {MAX_TRIANGLES})"
    )


def _add_view(command: argparse.ArgumentParser) -> None:
    group = command.add_argument_group("view", "directions are x, -x, y, ... or three numbers")
    group.add_argument(
        "--front",
        type=_direction,
        default="z",
        metavar="DIR",
        help="from the scene to the viewer (default: z)",
    )
    group.add_argument("--up", type=_direction, default="y", metavar="DIR", help="default: y")
    group.add_argument(
        "--viewpoint", type=_point, metavar="X Y Z",
        help="what is visible is seen from here, in relief units (default: infinitely far)",
    )  # fmt: skip
    group.add_argument(
        "--vanishing-point", type=_point, metavar="X Y Z",
        help="forced perspective towards this point behind the plane, in relief units (default: none)",
    )  # fmt: skip


def _add_params(command: argparse.ArgumentParser) -> None:
    default = ReliefParams()
    group = command.add_argument_group("relief")
    add = group.add_argument
    add("--params", type=Path, metavar="FILE.json",
        help="a parameter file, for the view, too; options beside it override what it says")  # fmt: skip
    add("--mode", choices=("attenuation", "bounded"),
        help="the paper's method, or the closest relief of a depth (default: with --depth)")  # fmt: skip
    add("-k", type=int, default=default.k, metavar="N", help="attenuation points (default: %(default)s)")
    add("--beta", type=_beta, default=default.beta, metavar="B[,B...]",
        help="attenuation factor, one or one per point (default: %(default)s)")  # fmt: skip
    for name, text in (
        ("discard_above", "t1: drop points with a larger relative differential"),
        ("attach_below", "t2: attach points with a smaller relative differential"),
        ("max_order_error", "t3: solve vertices with a larger depth order error again"),
        ("blend", "t: share of first order differentials there"),
    ):
        add(f"--{name.replace('_', '-')}", type=float, default=getattr(default, name), metavar="T",
            help=f"{text} (default: %(default)s)")  # fmt: skip
    for name, text in (
        ("smooth-points", "smooth around the points"),
        ("in-front", "keep what is visible in front of the plane, where it is not trimmed"),
        ("in-order", "let no part pass through another"),
    ):
        add(f"--{name}", action=argparse.BooleanOptionalAction, default=argparse.SUPPRESS,
            help=f"{text} (default: yes; the paper: no)")  # fmt: skip
    add("--min-gap", type=float, default=default.min_gap, metavar="G",
        help="smallest gap in depth between parts, in the input's unit (default: %(default)s)")  # fmt: skip
    add("--alpha", type=float, metavar="A", help="largest compression ratio (default: no compression)")
    add("--alpha-min", type=float, metavar="A", help="smallest compression ratio (default: half of alpha)")
    add("--depth", type=float, metavar="D", help="exact depth in the input's unit")
    add("--attach", type=_integers, default=(), metavar="N[,N...]",
        help="vertices to hold on the plane, bounded mode only")  # fmt: skip
    add("--seed", type=int, default=default.seed, metavar="N", help="default: %(default)s")
    # Some Pythons add the default of a switch to its help once more, if they know it: they are told here.
    command.set_defaults(smooth_points=True, in_front=True, in_order=True)
    # These are in parameter files only: one for each vertex, one for each point.
    command.set_defaults(weights=default.weights, point_edits=default.point_edits)


def _add_plate(command: argparse.ArgumentParser) -> None:
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


def chosen_view(options: argparse.Namespace) -> View:
    """Return the view that was asked for.

    Parameters
    ----------
    options : argparse.Namespace
        Of the command "make".

    Raises
    ------
    ParameterError
        A value out of its range.
    """
    return View(
        front=options.front,
        up=options.up,
        viewpoint=options.viewpoint,
        vanishing_point=options.vanishing_point,
    )


def chosen_params(options: argparse.Namespace) -> ReliefParams:
    """Return the parameters that were asked for.

    Parameters
    ----------
    options : argparse.Namespace
        Of the command "make".

    Raises
    ------
    ParameterError
        A value out of its range.
    """
    given = {name: getattr(options, name) for name in ReliefParams.__dataclass_fields__}
    if given["depth"] is None:
        # Stands in until the scene is read and its scale is known; not every command has it.
        given["depth"] = getattr(options, "depth_mm", None)
    return ReliefParams(**given)
