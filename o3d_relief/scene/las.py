"""LAS and LAZ, the files of lidar surveys, through laspy."""

from __future__ import annotations

import subprocess
import sys
from io import BytesIO

import numpy as np
from numpy.typing import NDArray

from o3d_relief.errors import FileError
from o3d_relief.scene.arrays import CloudArrays

__all__ = ["decode_las"]

_MOST_PER_BYTE = 200
"""Points that a byte of the file may stand for: LAZ packs well, but not better."""

_UNPACK = """
import io, sys, laspy
whole = io.BytesIO()
laspy.read(io.BytesIO(sys.stdin.buffer.read())).write(whole, do_compress=False)
sys.stdout.buffer.write(whole.getvalue())
"""

_PATIENCE = 600.0
"""Seconds that unpacking may take."""


def decode_las(data: bytes) -> CloudArrays:
    """Read a LAS or LAZ file.

    Parameters
    ----------
    data : bytes
        The file.

    Returns
    -------
    CloudArrays
        Points in the order of the file, with scale and offset applied; points that are marked as noise
        (classes 7 and 18) or as withheld are left out.

    Raises
    ------
    FileError
        laspy is missing, or the file is damaged: the reason, without the file's name.
    """
    try:
        import laspy
    except ImportError:
        raise FileError(
            "LAS and LAZ files need the packages laspy and lazrs (pip install 'laspy[lazrs]')"
        ) from None
    _check_header(data)
    try:
        las = laspy.read(BytesIO(_unpack(data) if data[104] & 0x80 else data))
        points = np.array(las.xyz, dtype=np.float64).reshape(-1, 3)
        kept = ~np.isin(np.asarray(las.classification), (7, 18))
    except (FileError, MemoryError):
        raise
    except Exception as error:  # damaged files fail in many ways inside laspy
        raise FileError(f"it is no LAS or LAZ file, or a damaged one ({error})") from error
    if len(points) < las.header.point_count:
        raise FileError("it ends too early, part of it is missing")
    if hasattr(las, "withheld"):
        kept &= np.asarray(las.withheld) == 0
    return CloudArrays(points=points[kept], colors=_read_colors(las, kept))


def _check_header(data: bytes) -> None:
    """Refuse counts at which laspy goes on for minutes: of records that have 54 or 60 bytes at least."""
    if data[:4] != b"LASF" or len(data) < 227:
        raise FileError("it is no LAS or LAZ file, or it ends too early")
    records, points = (int.from_bytes(data[at : at + 4], "little") for at in (100, 107))
    extended = 0
    if data[25] >= 4:  # LAS 1.4
        extended = int.from_bytes(data[243:247], "little")
        points = max(points, int.from_bytes(data[247:255], "little"))
    if 54 * records > len(data) or 60 * extended > len(data):
        raise FileError("it says that it has more records than so short a file can hold")
    if points > _MOST_PER_BYTE * len(data):
        raise FileError("it says that it has more points than so short a file can hold")


def _unpack(data: bytes) -> bytes:
    """Turn a LAZ file into a LAS file, in a process of its own: the decoder ends its process on bad input."""
    try:
        child = subprocess.run(
            [sys.executable, "-c", _UNPACK],
            input=data,
            capture_output=True,
            timeout=_PATIENCE,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise FileError("it could not be unpacked within ten minutes") from None
    if child.returncode != 0:
        words = child.stderr.decode("utf-8", "replace").strip().splitlines() or ["its decoder has failed"]
        raise FileError(f"it is no LAZ file, or a damaged one ({words[-1][:200]})")
    return child.stdout


def _read_colors(las: object, kept: NDArray[np.bool_]) -> NDArray[np.float64] | None:
    """Return colours from 0 to 1; they have 16 bits, but many programs write 8."""
    if not all(hasattr(las, name) for name in ("red", "green", "blue")):
        return None
    colors = np.stack([np.asarray(getattr(las, name)) for name in ("red", "green", "blue")], axis=1)[kept]
    largest = int(colors.max(initial=0))
    return None if largest == 0 else colors / (255.0 if largest < 256 else 65535.0)
