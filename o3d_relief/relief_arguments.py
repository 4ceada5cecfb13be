"""The words of the command line for the relief itself: view and parameters."""

from __future__ import annotations

import argparse
import re
from pathlib import Path

from o3d_relief.params import ReliefParams, View

__all__ = ["add_params", "add_view", "axis", "chosen_params", "chosen_view", "point"]

_AXIS = re.compile(r"[+-]?[xyzXYZ]$")


def axis(text: str) -> bool:
    """Tell whether a word is the name of an axis."""
    return _AXIS.match(text) is not None


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


def point(text: str) -> tuple[float, ...]:
    """Read three numbers with commas between them."""
    numbers = _numbers(text)
    if len(numbers) != 3:
        raise argparse.ArgumentTypeError(f"must be three numbers. Got {text!r} instead.")
    return numbers


def _direction(text: str) -> str | tuple[float, ...]:
    if axis(text):
        return text
    try:
        return point(text)
    except argparse.ArgumentTypeError:
        raise argparse.ArgumentTypeError(
            f"must be x, -x, y, -y, z, -z or three numbers. Got {text!r} instead."
        ) from None


def _beta(text: str) -> float | tuple[float, ...]:
    numbers = _numbers(text)
    return numbers[0] if len(numbers) == 1 else numbers


def _depth(text: str) -> float | str:
    """Read a length; what is none is a share, or what the parameters refuse."""
    try:
        return float(text)
    except ValueError:
        return text


def add_view(command: argparse.ArgumentParser) -> None:
    """Add the options of the view.

    Parameters
    ----------
    command : argparse.ArgumentParser
    """
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
        "--viewpoint", type=point, metavar="X Y Z",
        help="what is visible is seen from here, in relief units (default: infinitely far)",
    )  # fmt: skip
    group.add_argument(
        "--vanishing-point", type=point, metavar="X Y Z",
        help="forced perspective towards this point behind the plane, in relief units (default: none)",
    )  # fmt: skip


def add_params(command: argparse.ArgumentParser) -> None:
    """Add the options of the relief itself.

    Parameters
    ----------
    command : argparse.ArgumentParser
    """
    default = ReliefParams()
    group = command.add_argument_group("relief")
    add = group.add_argument
    add("--params", type=Path, metavar="FILE.json",
        help="a parameter file, for the view, too; options beside it override what it says")  # fmt: skip
    add("--mode", choices=("attenuation", "bounded"),
        help="the paper's method, or the closest relief of a depth (default: with --depth)")  # fmt: skip
    add(
        "-k",
        "--k",
        type=int,
        default=default.k,
        metavar="N",
        help="attenuation points (default: %(default)s)",
    )
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
    add("--depth", type=_depth, metavar="D",
        help="exact depth, in the input's unit or as a share of the depth that is seen, as 25%%")  # fmt: skip
    add("--attach", type=_integers, default=(), metavar="N[,N...]",
        help="vertices to hold on the plane, bounded mode only")  # fmt: skip
    add("--seed", type=int, default=default.seed, metavar="N", help="default: %(default)s")
    # Some Pythons add the default of a switch to its help once more, if they know it: they are told here.
    command.set_defaults(smooth_points=True, in_front=True, in_order=True)
    # These are in parameter files only: one for each vertex, one for each point.
    command.set_defaults(weights=default.weights, point_edits=default.point_edits)


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
