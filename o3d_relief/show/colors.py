"""Colour maps, the palette of the clusters, and the way between sRGB and linear light."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from o3d_relief.errors import ParameterError

__all__ = ["COLORMAPS", "PALETTE", "apply_colormap", "finite_range", "label_colors", "to_linear", "to_srgb"]


def _rgb(codes: str) -> NDArray[np.float64]:
    return np.array([[int(code[i : i + 2], 16) for i in (0, 2, 4)] for code in codes.split()]) / 255.0


COLORMAPS = {
    "viridis": _rgb("440154 482878 3e4989 31688e 26828e 1f9e89 35b779 6ece58 b5de2b fde725"),
    "diverging": _rgb("1f3f87 3f78bf 8fb8dd d3e1ea f1eee6 f2cda9 e08a5c bf3f35 7f1526"),
    "heat": _rgb("ece7db f8e29a f9b54c ea6f2b c42a22 7d0f22 3d0818"),
}
"""Tables of sRGB colours in [0, 1], evenly spaced: fields, signed fields, errors."""

PALETTE = _rgb(
    "d1495b 3d7ea6 edae49 4f9d69 8d5b9f e07b39 2a9d8f c7b8a0 7a4b3a 9bc53d f2a1b5 5a6fc0 6b6f72 b3d9e8"
)
"""Well distinguishable sRGB colours for groups."""


def to_linear(srgb: ArrayLike) -> NDArray[np.float32]:
    """Turn sRGB values in [0, 1] into linear light (IEC 61966-2-1).

    Examples
    --------
    >>> to_linear([0.0, 1.0]).tolist()
    [0.0, 1.0]
    """
    value = np.clip(np.asarray(srgb, dtype=np.float32), 0.0, 1.0)
    power = ((value + np.float32(0.055)) / np.float32(1.055)) ** np.float32(2.4)
    linear: NDArray[np.float32] = np.where(value <= 0.04045, value / np.float32(12.92), power)
    return linear


def to_srgb(linear: ArrayLike) -> NDArray[np.float32]:
    """Turn linear light in [0, 1] into sRGB values, the inverse of `to_linear`.

    Examples
    --------
    >>> to_srgb([0.0, 1.0, 2.0]).round(5).tolist()
    [0.0, 1.0, 1.0]
    """
    value = np.clip(np.asarray(linear, dtype=np.float32), 0.0, 1.0)
    power = np.float32(1.055) * value ** np.float32(1.0 / 2.4) - np.float32(0.055)
    srgb: NDArray[np.float32] = np.where(value <= 0.0031308, value * np.float32(12.92), power)
    return srgb


def apply_colormap(
    values: ArrayLike, name: str = "viridis", value_range: tuple[float, float] | None = None
) -> NDArray[np.float64]:
    """Turn numbers into sRGB colours.

    Parameters
    ----------
    values : (...) float
        The numbers; those outside the range take the colour of its end, those that are not finite a
        neutral grey.
    name : str
        A key of `COLORMAPS`.
    value_range : (low, high), optional
        What the ends of the colour map stand for. None: the least and the greatest finite value.

    Returns
    -------
    (..., 3) float64

    Raises
    ------
    ParameterError
        An unknown name.

    Examples
    --------
    >>> bool(np.all(apply_colormap([3.0, 7.0])[0] == COLORMAPS["viridis"][0]))
    True
    """
    if name not in COLORMAPS:
        raise ParameterError(f"colormap must be one of {', '.join(COLORMAPS)}. Got {name!r} instead.")
    table = COLORMAPS[name]
    numbers = np.asarray(values, dtype=np.float64)
    low, high = finite_range(numbers) if value_range is None else value_range
    width = high - low if high > low else 1.0
    known = np.isfinite(numbers)
    place = np.clip((np.where(known, numbers, low) - low) / width, 0.0, 1.0) * (len(table) - 1)
    left = np.minimum(place.astype(np.int64), len(table) - 2)
    part = (place - left)[..., None]
    colors = table[left] * (1.0 - part) + table[left + 1] * part
    return np.where(known[..., None], colors, 0.62)


def finite_range(values: NDArray[np.float64]) -> tuple[float, float]:
    """Return the least and the greatest finite value, (0, 1) where there is none."""
    finite = values[np.isfinite(values)]
    return (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 1.0)


def label_colors(labels: NDArray[np.int64], faces: NDArray[np.int64]) -> NDArray[np.float64]:
    """Give every label a palette colour, so that labels that share an edge differ where possible.

    The labels are coloured greedily in their order; each takes, of the colours that no neighbour has,
    the one used least so far.

    Parameters
    ----------
    labels : (n,) int64
        Label of each vertex, 0 or greater.
    faces : (m, 3) int64

    Returns
    -------
    (labels.max() + 1, 3) float64
        sRGB colour of each label.

    Examples
    --------
    >>> colors = label_colors(np.array([0, 1, 1]), np.array([[0, 1, 2]]))
    >>> bool(np.all(colors[0] == colors[1]))
    False
    """
    count = int(labels.max()) + 1 if len(labels) else 0
    edges = labels[np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])]
    edges = edges[edges[:, 0] != edges[:, 1]]
    codes = np.unique(np.concatenate([edges[:, 0] * count + edges[:, 1], edges[:, 1] * count + edges[:, 0]]))
    start = np.searchsorted(codes, np.arange(count + 1) * count)
    chosen = np.full(count, -1)
    used = np.zeros(len(PALETTE), dtype=np.int64)
    for label in range(count):
        taken = chosen[codes[start[label] : start[label + 1]] % max(count, 1)]
        cost = used.astype(np.float64)
        np.add.at(cost, taken[taken >= 0], count + 1.0)
        chosen[label] = int(np.argmin(cost))
        used[chosen[label]] += 1
    return np.asarray(PALETTE[chosen])
