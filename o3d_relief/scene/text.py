"""Numbers out of lines of text."""

from __future__ import annotations

from itertools import chain

import numpy as np
from numpy.typing import NDArray

from o3d_relief.errors import FileError

__all__ = ["decode_text", "to_table"]


def decode_text(data: bytes) -> str:
    """Turn bytes into text, whatever program wrote them.

    Parameters
    ----------
    data : bytes
        UTF-8, else taken for Latin-1.

    Returns
    -------
    str
        The text; a line that ends in a backslash is joined with the next one.

    Examples
    --------
    >>> decode_text("é".encode("latin-1"))
    'é'
    """
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    return text.replace("\\\r\n", " ").replace("\\\n", " ")


def to_table(lines: list[str], least: int) -> NDArray[np.float64]:
    """Read a table of numbers.

    Parameters
    ----------
    lines : list of str
        A row each.
    least : int
        The smallest number of columns allowed.

    Returns
    -------
    (n, columns) float64
        As many columns as the shortest line has.

    Raises
    ------
    FileError
        A line that is too short, or a word where a number should be.

    Examples
    --------
    >>> to_table(["1 2 3", "4 5"], 2)
    array([[1., 2.],
           [4., 5.]])
    """
    rows = [line.split() for line in lines]
    columns = min(map(len, rows), default=least)
    if columns < least:
        raise FileError(f"it has a line with fewer than {least} numbers")
    try:
        values = np.array(list(map(float, chain.from_iterable(row[:columns] for row in rows))))
    except ValueError:
        raise FileError("it has text where numbers should be") from None
    return values.reshape(-1, columns)
