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
from o3d_relief.limits import MAX_TRIANGLES
from o3d_relief.params_file import field_values, load_params
from o3d_relief.plate_arguments import add_plate
from o3d_relief.relief_arguments import add_params, add_view, axis
from o3d_relief.scan_arguments import add_scan
from o3d_relief.window_arguments import add_windows
from o3d_relief.workshop_arguments import add_workshop

__all__ = ["parse"]

_POINTS = ("--front", "--up", "--viewpoint", "--vanishing-point", "--sensor")
_FORMATS = "PLY, OBJ, STL, OFF, GLB, glTF, PCD, XYZ, PTS, LAS or LAZ"
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?$")


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
    parser = _parser({})
    options, unknown = parser.parse_known_args(words)
    if unknown:  # argparse would point to the help of all commands
        parser.prog += f" {options.command}"
        parser.error(f"unrecognized arguments: {' '.join(unknown)}")
    if getattr(options, "params", None) is None:
        return options
    params, view = load_params(options.params)
    replaced = field_values(params) | field_values(view)
    deep, squeezed = _given(options, ("depth", "depth_mm")), _given(options, ("alpha",))
    if deep and not squeezed and params.alpha is not None:  # in place of what the file says, not beside it
        replaced |= {"alpha": None, "alpha_min": None}
    if (squeezed and not deep) or _given(options, ("depth_mm",)):
        replaced |= {"depth": None}
    return _parser(replaced).parse_args(words)


def _given(options: argparse.Namespace, names: Sequence[str]) -> bool:
    return any(getattr(options, name, None) is not None for name in names)


class _Parser(argparse.ArgumentParser):
    """A parser that takes whole words only, and says what is wrong in one sentence."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**options, allow_abbrev=False)

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
            elif axis(following[0]) or "," in following[0]:
                word, position = f"{word}={following[0]}", position + 1
        joined.append(word)
    return joined


def _parser(replaced: dict[str, Any]) -> argparse.ArgumentParser:
    """Build the parser; `replaced` holds values in place of the defaults of the commands."""
    parser = _Parser(prog="o3d-relief", description="Make high reliefs from 3D scenes.")
    parser.add_argument("--version", action="version", version=f"o3d-relief {__version__}")
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND", dest="command")

    _add_make(commands, replaced)
    _add_batch(commands, replaced)
    add_windows(commands, _FORMATS, [add_view, add_params, add_scan, _add_limit], replaced)
    _add_demo(commands)
    return parser


def _add_make(commands: Any, replaced: dict[str, Any]) -> None:
    make = commands.add_parser(
        "make",
        help="make a relief of a mesh or of a point cloud",
        description="Make a relief of a mesh file, or of a point cloud, which is meshed first.",
    )
    make.add_argument("input", type=Path, metavar="INPUT", help=f"{_FORMATS} file")
    make.add_argument("output", type=Path, metavar="OUTPUT", help="PLY, OBJ, STL or GLB file; 3MF for solids")
    add_view(make)
    add_params(make)
    add_scan(make)
    add_plate(make)
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
        "--dry-run", action="store_true",
        help="only tell sizes, volume, triangles and memory in advance; refuses the parameters and meshes "
        "that the run would refuse before its long work",
    )  # fmt: skip
    _add_limit(make)
    make.set_defaults(**replaced)


def _add_batch(commands: Any, replaced: dict[str, Any]) -> None:
    many = commands.add_parser(
        "batch",
        help="make reliefs of many files at once",
        description="Make a relief of each of many meshes and point clouds, on all cores or on a cluster. "
        "After an interruption the same command goes on where it was.",
    )
    add_batch(many)
    add_view(many)
    add_params(many)
    add_scan(many)
    many.set_defaults(**replaced)


def _add_demo(commands: Any) -> None:
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


def _add_limit(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "--max-triangles", type=int, metavar="N", help=f"refuse larger meshes (default: {MAX_TRIANGLES})"
    )
