"""XYZ and PTS: a point a line, and what the columns after x, y and z mean."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from o3d_relief.errors import FileError
from o3d_relief.scene.arrays import CloudArrays
from o3d_relief.scene.text import decode_text, to_table

__all__ = ["decode_point_list"]


def decode_point_list(data: bytes) -> CloudArrays:
    r"""Read a list of points.

    Three numbers a line are a point; a fourth is an intensity, which is left out; three more are a colour
    (0 to 255, or 0 to 1) or, if they have unit length throughout, a normal, and after a normal there may be
    a colour. The first line may be the number of points. Lines that start with # or // are left out, commas
    and semicolons read as blanks.

    Parameters
    ----------
    data : bytes
        The file.

    Returns
    -------
    CloudArrays
        Points in the order of the file.

    Raises
    ------
    FileError
        Not a list of points, or fewer than it says: the reason, without the file's name.

    Examples
    --------
    >>> decode_point_list(b"2\n0 0 0 10 255 0 0\n1 0 0 20 0 255 0\n").colors
    array([[1., 0., 0.],
           [0., 1., 0.]])
    """
    text = decode_text(data).replace(",", " ").replace(";", " ")
    lines = [line for raw in text.splitlines() if (line := raw.strip()) and not line.startswith(("#", "//"))]
    count = len(lines)
    if lines and len(lines[0].split()) == 1 and lines[0].isdecimal():
        count = int(lines[0])
        lines = lines[1:]
    if not lines:
        raise FileError("it has no points")
    if count > len(lines):
        raise FileError("it ends too early, part of it is missing")
    table = to_table(lines[:count] if count else lines, 3)
    columns = table.shape[1]
    extra = table[:, 4:] if columns in (4, 7, 10) else table[:, 3:]
    normals = None
    if extra.shape[1] >= 3 and _are_normals(extra[:, :3]):
        normals, extra = extra[:, :3], extra[:, 3:]
    colors = extra[:, :3] if extra.shape[1] >= 3 else None
    return CloudArrays(points=table[:, :3], colors=_to_shares(colors), normals=normals)


def _are_normals(values: NDArray[np.float64]) -> bool:
    """Tell normals (n, 3) from colours: nearly all have unit length, and some point backwards."""
    unit = np.abs(np.linalg.norm(values, axis=1) - 1.0) < 0.02
    return bool(unit.mean() > 0.9 and (values < 0.0).any())


def _to_shares(colors: NDArray[np.float64] | None) -> NDArray[np.float64] | None:
    """Return colours from 0 to 1; None for numbers that are no colours."""
    if colors is None or not np.isfinite(colors).all() or colors.min() < 0.0:
        return None
    largest = colors.max()
    for whole in (1.0, 255.0, 65535.0):
        if largest <= whole:
            return colors / whole
    return None
