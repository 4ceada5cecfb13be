"""STL, binary and ASCII: triangles that share no vertices."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from o3d_relief.errors import FileError
from o3d_relief.scene.arrays import MeshArrays

__all__ = ["decode_stl"]

_HEADER = 84
_TRIANGLE = np.dtype([("normal", "<f4", (3,)), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_TOO_SHORT = "it ends too early, part of it is missing"


def decode_stl(data: bytes) -> MeshArrays:
    """Read an STL file.

    Parameters
    ----------
    data : bytes
        The file.

    Returns
    -------
    MeshArrays
        Three vertices for each triangle, in the order of the file.

    Raises
    ------
    FileError
        Not an STL file, or a damaged one: the reason, without the file's name.

    Examples
    --------
    >>> text = b"solid a facet normal 0 0 1 outer loop vertex 0 0 0 vertex 1 0 0 vertex 0 1 0 endloop"
    >>> decode_stl(text.replace(b" facet", bytes([10]) + b"facet") + b" endfacet endsolid").faces
    array([[0, 1, 2]])
    """
    count = int.from_bytes(data[80:_HEADER], "little")
    size = _HEADER + count * _TRIANGLE.itemsize
    if len(data) >= _HEADER and len(data) == size:
        corners = np.frombuffer(data, dtype=_TRIANGLE, offset=_HEADER)["corners"].reshape(-1, 3)
    elif data.lstrip()[:5].lower() == b"solid":
        corners = _read_ascii(data)
    elif len(data) < size or len(data) < _HEADER:
        raise FileError(_TOO_SHORT)
    else:
        raise FileError("its length does not fit its number of triangles")
    with np.errstate(invalid="ignore"):  # a signalling NaN
        vertices = corners.astype(np.float64)
    return MeshArrays(vertices=vertices, faces=np.arange(len(vertices), dtype=np.int64).reshape(-1, 3))


def _read_ascii(data: bytes) -> NDArray[np.float64]:
    """Return the corners (3m, 3)."""
    # The name of a solid, which may be any words, stands on its line.
    words = re.sub(rb"(?m)^\s*(end)?solid\b.*$", rb"\1solid", data.lower()).split()
    facets = words.count(b"facet")
    places = [i for i, word in enumerate(words) if word == b"vertex"]
    if b"endsolid" not in words[-1:] or words.count(b"endfacet") != facets or len(places) != 3 * facets:
        raise FileError(_TOO_SHORT)
    try:
        return np.array([list(map(float, words[i + 1 : i + 4])) for i in places]).reshape(-1, 3)
    except ValueError:
        raise FileError("it has text where numbers should be") from None
