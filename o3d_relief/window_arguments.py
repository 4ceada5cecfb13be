"""The words of the command line for the windows."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

__all__ = ["add_windows"]

AddOptions = Callable[[argparse.ArgumentParser], None]


def add_windows(
    commands: Any, formats: str, options: Sequence[AddOptions], replaced: Mapping[str, Any]
) -> None:
    """Add the commands "view" and "edit".

    Parameters
    ----------
    commands : subparsers of argparse
    formats : str
        The kinds of files that can be read.
    options : sequence of callable
        Each adds options of the command "make".
    replaced : mapping of str to anything
        Values in place of the defaults.
    """
    view = commands.add_parser(
        "view",
        help="make a relief and step through its stages in a window",
        description="Make a relief and show each stage in a window as soon as it is computed.",
    )
    edit = commands.add_parser(
        "edit",
        help="change a relief in a window and see it follow",
        description="Change a relief's parameters and single points in a window and see it follow.",
    )
    edit.add_argument("-o", "--output", type=Path, metavar="OUT", help='where "Save relief" writes to')
    edit.add_argument(
        "--size-mm", type=float, default=150.0, metavar="MM",
        help="length of the relief's larger side, for the slider of the depth (default: %(default)g)",
    )  # fmt: skip
    for command in (view, edit):
        command.add_argument("input", type=Path, metavar="INPUT", help=f"{formats} file")
        for add in options:
            add(command)
        command.set_defaults(**replaced)
