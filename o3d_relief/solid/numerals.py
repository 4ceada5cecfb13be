"""Numbers that are engraved into the back of a tile."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import manifold3d

__all__ = ["engraving"]

# The seven strokes of a digit, one wide and two high, as start and end.
_STROKES = {
    "a": ((0, 2), (1, 2)),
    "b": ((1, 2), (1, 1)),
    "c": ((1, 1), (1, 0)),
    "d": ((0, 0), (1, 0)),
    "e": ((0, 0), (0, 1)),
    "f": ((0, 1), (0, 2)),
    "g": ((0, 1), (1, 1)),
}
_DIGITS = ("abcdef", "bc", "abged", "abgcd", "fgbc", "afgcd", "afgedc", "abc", "abcdefg", "abcfgd")
_PITCH = 1.7
"""From digit to digit."""
_LINE = -0.6
"""Where the line below the number lies: it tells 6 from 9, and which side is down."""
_LARGEST, _SMALLEST = 16.0, 4.0
"""Height of a digit in millimetres."""
_STROKE = 0.14
"""Width of a stroke, of the height of a digit."""


def engraving(tile: manifold3d.Manifold, number: int, *, depth: float) -> manifold3d.Manifold | None:
    """Return what to take away from the back of a tile for its number, with a line below it.

    It stands in the middle of the largest circle on the back, and reads right from behind.

    Parameters
    ----------
    tile : manifold3d.Manifold
        Its back is flat and faces -z.
    number : int
        At least 0.
    depth : float
        In millimetres.

    Returns
    -------
    manifold3d.Manifold or None
        None where even digits of 4 mm do not fit.
    """
    import manifold3d

    back = tile.bounding_box()[2]
    middle, radius = _largest_circle(tile.slice(back + depth))
    lines = _lines(number)
    center = (lines.reshape(-1, 2).min(axis=0) + lines.reshape(-1, 2).max(axis=0)) / 2
    half = float(np.linalg.norm(lines.reshape(-1, 2) - center, axis=1).max()) + 2.0 * _STROKE
    height = min(_LARGEST, 2.0 * radius / half)
    if height < _SMALLEST:
        return None
    size, stroke = height / 2.0, _STROKE * height / 2.0
    strokes = []
    for line in lines:
        # Mirrored: it is read from behind.
        ends = (line - center) * size * np.array([-1.0, 1.0]) + middle
        low, high = ends.min(axis=0) - stroke, ends.max(axis=0) + stroke
        strokes.append(manifold3d.CrossSection.square((high - low).tolist()).translate(low.tolist()))
    drawn = manifold3d.CrossSection.batch_boolean(strokes, manifold3d.OpType.Add)
    return drawn.extrude(depth + 1.0).translate([0.0, 0.0, back - 1.0])


def _lines(number: int) -> NDArray[np.float64]:
    """Return the strokes (s, 2, 2) of a number by start and end, digits two high, and the line below."""
    digits = [int(letter) for letter in str(number)]
    lines = [
        np.add(_STROKES[name], [place * _PITCH, 0.0])
        for place, digit in enumerate(digits)
        for name in _DIGITS[digit]
    ]
    below = [[0.0, _LINE], [(len(digits) - 1) * _PITCH + 1.0, _LINE]]
    return np.array([*lines, below])


def _largest_circle(area: manifold3d.CrossSection) -> tuple[NDArray[np.float64], float]:
    """Return middle and radius of the largest circle in an area, to a hundredth of a millimetre."""
    import manifold3d

    least_x, least_y, most_x, most_y = area.bounds()
    low, high = 0.0, max(most_x - least_x, most_y - least_y)
    inner = area
    while high - low > 0.01:
        radius = (low + high) / 2
        shrunk = area.offset(-radius, manifold3d.JoinType.Miter)
        if shrunk.is_empty():
            high = radius
        else:
            low, inner = radius, shrunk
    if low == 0.0:
        return np.zeros(2), 0.0
    largest = max(inner.decompose(), key=lambda part: part.area())
    x0, y0, x1, y1 = largest.bounds()
    return np.array([(x0 + x1) / 2, (y0 + y1) / 2]), low
