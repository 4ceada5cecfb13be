"""The words of the command line that say where a batch comes from, goes to and runs."""

from __future__ import annotations

import argparse
from pathlib import Path

from o3d_relief.limits import MAX_TRIANGLES

__all__ = ["add_batch"]


def add_batch(command: argparse.ArgumentParser) -> None:
    """Add what the command "batch" has and "make" has not.

    Parameters
    ----------
    command : argparse.ArgumentParser
    """
    add = command.add_argument
    add("inputs", type=Path, nargs="+", metavar="INPUT",
        help="files, or folders for all meshes and point clouds in them")  # fmt: skip
    add("--out", type=Path, required=True, metavar="DIR",
        help="folder for the reliefs, their pictures, contact_sheet.png and manifest.jsonl")  # fmt: skip
    add("--format", choices=("ply", "obj", "stl", "glb"), default="ply",
        help="of the reliefs (default: %(default)s)")  # fmt: skip
    add("--jobs", type=int, metavar="N",
        help="reliefs at the same time (default: one for each core, or worker of the cluster)")  # fmt: skip
    add("--engine", choices=("loky", "dask", "ray"), default="loky",
        help="processes on this machine, or a cluster (default: %(default)s)")  # fmt: skip
    add("--scheduler", metavar="ADDRESS",
        help="of the Dask or Ray cluster (default: one on this machine)")  # fmt: skip
    add("--certificates", action="store_true",
        help="test what each relief keeps, which takes time and memory, and note it")  # fmt: skip
    add("--strict", action="store_true",
        help="refuse reliefs that do not keep what --certificates tests, and go on")  # fmt: skip
    add("--dry-run", action="store_true",
        help="only tell, one after the other, what the reliefs will measure and which inputs would fail, "
        "but for what --strict would refuse; nothing is written")  # fmt: skip
    add("--max-triangles", type=int, metavar="N",
        help=f"refuse larger meshes (default: {MAX_TRIANGLES})")  # fmt: skip
