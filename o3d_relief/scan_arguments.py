"""The words of the command line that say how a point cloud is meshed."""

from __future__ import annotations

import argparse
import re

from o3d_relief.errors import ParameterError
from o3d_relief.relief_arguments import point
from o3d_relief.scan_params import ScanParams

__all__ = ["add_scan", "chosen_scan"]


def add_scan(command: argparse.ArgumentParser) -> None:
    """Add the options for point clouds.

    Parameters
    ----------
    command : argparse.ArgumentParser
    """
    default = ScanParams()
    add = command.add_argument_group("point clouds", "lengths are in spacings of the points").add_argument
    add("--sensor", type=point, metavar="X Y Z",
        help="where the scanner stood, in the file's frame (default: found out)")  # fmt: skip
    add("--remove-ground", action="store_true", help="remove the floor or table under the object")
    add("--no-file-normals", dest="file_normals", action="store_false",
        help="estimate normals, even if the file has good ones")  # fmt: skip
    add("--scan-depth", type=int, metavar="N",
        help="depth of the Poisson octree (default: cells as wide as the spacing)")  # fmt: skip
    add("--max-points", type=int, default=default.max_points, metavar="N",
        help="thin larger clouds, to save memory (default: %(default)s)")  # fmt: skip
    add("--outliers", type=float, default=default.outliers, metavar="D",
        help="drop points so many standard deviations off, 0 for none (default: %(default)s)")  # fmt: skip
    add("--max-hole", type=float, default=default.max_hole, metavar="W",
        help="close holes up to this width (default: %(default)s)")  # fmt: skip
    add("--min-part", type=float, default=default.min_part, metavar="S",
        help="drop parts with a smaller share of the area of the largest (default: %(default)s)")  # fmt: skip
    add("--scan-threads", type=int, default=default.threads, metavar="N",
        help="more than one: results differ a little from run to run (default: %(default)s)")  # fmt: skip


def chosen_scan(options: argparse.Namespace) -> ScanParams:
    """Return how a point cloud is to be meshed.

    Parameters
    ----------
    options : argparse.Namespace
        Of the command "make".

    Raises
    ------
    ParameterError
        A value out of its range.
    """
    try:
        return ScanParams(
            sensor=options.sensor,
            remove_ground=options.remove_ground,
            file_normals=options.file_normals,
            depth=options.scan_depth,
            max_points=options.max_points,
            outliers=None if options.outliers == 0.0 else options.outliers,
            max_hole=options.max_hole,
            min_part=options.min_part,
            threads=options.scan_threads,
            seed=options.seed,
        )
    except ParameterError as error:
        # Two options have longer names than their parameters, since a relief has a depth as well.
        raise ParameterError(re.sub("^(depth|threads) ", r"scan_\1 ", str(error))) from error
