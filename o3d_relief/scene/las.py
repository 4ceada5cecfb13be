"""LAS and LAZ, the files of lidar surveys, through laspy."""

from __future__ import annotations

from io import BytesIO

import numpy as np
from numpy.typing import NDArray

from o3d_relief.errors import FileError
from o3d_relief.scene.arrays import CloudArrays

__all__ = ["decode_las"]

_MOST_PER_BYTE = 200
"""Points that a byte of the file may stand for: LAZ packs well, but not better."""


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
            "LAS and LAZ files need the packages laspy and lazrs (pip install 'o3d-relief[las]')"
        ) from None
    _check_header(data)
    try:
        with laspy.open(BytesIO(data)) as reader:
            if reader.header.point_count > _MOST_PER_BYTE * len(data):
                raise FileError("it says that it has more points than so short a file can hold")
            las = reader.read()
    except (FileError, KeyboardInterrupt, MemoryError):
        raise
    # Damaged files fail in many ways inside laspy and its decoder, which ends in panics of its own kind.
    except BaseException as error:
        raise FileError(f"it is no LAS or LAZ file, or a damaged one ({error})") from error
    kept = ~np.isin(np.asarray(las.classification), (7, 18))
    if hasattr(las, "withheld"):
        kept &= np.asarray(las.withheld) == 0
    points = np.array(las.xyz, dtype=np.float64).reshape(-1, 3)[kept]
    if len(points) < las.header.point_count - int((~kept).sum()):
        raise FileError("it ends too early, part of it is missing")
    return CloudArrays(points=points, colors=_read_colors(las, kept))


def _check_header(data: bytes) -> None:
    """Refuse counts at which laspy would go on for minutes: of records that have 54 or 60 bytes at least."""
    if data[:4] != b"LASF" or len(data) < 227:
        raise FileError("it is no LAS or LAZ file, or it ends too early")
    records = int.from_bytes(data[100:104], "little")
    extended = int.from_bytes(data[243:247], "little") if data[25] >= 4 else 0
    if 54 * records > len(data) or 60 * extended > len(data):
        raise FileError("it says that it has more records than so short a file can hold")


def _read_colors(las: object, kept: NDArray[np.bool_]) -> NDArray[np.float64] | None:
    """Return colours from 0 to 1; they have 16 bits, but many programs write 8."""
    if not all(hasattr(las, name) for name in ("red", "green", "blue")):
        return None
    colors = np.stack([np.asarray(getattr(las, name)) for name in ("red", "green", "blue")], axis=1)[kept]
    largest = int(colors.max(initial=0))
    return None if largest == 0 else colors / (255.0 if largest < 256 else 65535.0)
