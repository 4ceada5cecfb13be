"""OFF: polygons in text, with or without vertex colours."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from o3d_relief.errors import FileError
from o3d_relief.scene.arrays import MeshArrays
from o3d_relief.scene.polygons import fan
from o3d_relief.scene.text import decode_text, to_table

__all__ = ["decode_off"]

_COLOR_COLUMN = {"OFF": 0, "COFF": 3, "NOFF": 0, "CNOFF": 6}
_TOO_SHORT = "it ends too early, part of it is missing"


def decode_off(data: bytes) -> MeshArrays:
    r"""Read an OFF file.

    Parameters
    ----------
    data : bytes
        The file: OFF, COFF (vertex colours), NOFF or CNOFF (normals, which are left out).

    Returns
    -------
    MeshArrays
        Vertices and faces in the order of the file; polygons are cut into fans. Indices are not checked.

    Raises
    ------
    FileError
        Not an OFF file, or a damaged one: the reason, without the file's name.

    Examples
    --------
    >>> decode_off(b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n").faces
    array([[0, 1, 2]])
    """
    lines = [line for raw in decode_text(data).splitlines() if (line := raw.split("#", 1)[0].strip())]
    kind, *rest = lines[0].split() if lines else [""]
    if kind not in _COLOR_COLUMN:
        raise FileError("it is not an OFF file in text form")
    lines = [" ".join(rest), *lines[1:]] if rest else lines[1:]
    sizes = lines[0].split() if lines else []
    if len(sizes) < 2 or not all(word.isdecimal() for word in sizes[:2]):
        raise FileError("it does not say how many vertices and faces it has")
    n, m = map(int, sizes[:2])
    if len(lines) < 1 + n + m:
        raise FileError(_TOO_SHORT)
    column = _COLOR_COLUMN[kind]
    table = to_table(lines[1 : 1 + n], column + 3 if column else 3)
    colors = table[:, column : column + 3] if column else None
    if colors is not None and colors.max(initial=0.0) > 1.0:
        colors = colors / 255.0
    return MeshArrays(vertices=table[:, :3], faces=_read_faces(lines[1 + n : 1 + n + m]), colors=colors)


def _read_faces(lines: list[str]) -> NDArray[np.int64]:
    """Return the triangles (m, 3); what follows the indices, a colour, is left out."""
    try:
        rows = [line.split() for line in lines]
        polygons = [list(map(int, row[1 : 1 + int(row[0])])) for row in rows]
        counts = np.array([int(row[0]) for row in rows], dtype=np.int64)
        flat = np.array([index for polygon in polygons for index in polygon], dtype=np.int64)
    except (ValueError, OverflowError):
        raise FileError("it has text where numbers should be") from None
    if any(len(polygon) != count for polygon, count in zip(polygons, counts, strict=True)):
        raise FileError(_TOO_SHORT)
    return flat[fan(counts)].reshape(-1, 3)
