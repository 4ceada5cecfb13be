"""Checks of arguments that are arrays: each returns float64, or says what is wrong."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from o3d_relief.errors import ParameterError
from o3d_relief.param_checks import check_whole, told

__all__ = [
    "as_numbers",
    "check_array",
    "check_colors",
    "check_ends",
    "check_picture",
    "check_size",
    "check_views",
]

_ROUNDING = 1e-6
"""How far beyond 0 and 1 a colour may lie."""


def as_numbers(name: str, value: object, wanted: str = "numbers") -> NDArray[np.float64]:
    """Return numbers as an array; `wanted` is what the sentence says they must be.

    Examples
    --------
    >>> as_numbers("bounds", [1, 2])
    array([1., 2.])
    """
    try:
        return np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise ParameterError(f"{name} must be {wanted}. Got {told(value)} instead.") from None


def check_array(name: str, value: object, shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Return numbers of one shape; they need not be finite."""
    array = as_numbers(name, value)
    if array.shape != shape:
        raise ParameterError(f"{name} must have the shape {shape}. Got {array.shape} instead.")
    return array


def check_colors(name: str, value: object, shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Return colours of one shape, from 0 to 1 but for rounding errors."""
    array = check_array(name, value, shape)
    wrong = array[~((array >= -_ROUNDING) & (array <= 1.0 + _ROUNDING))]
    if len(wrong):
        raise ParameterError(f"{name} must be finite, from 0 to 1. Got {wrong[0]:g} instead.")
    return array


def check_ends(name: str, value: object) -> tuple[float, float]:
    """Return both ends of a range.

    Examples
    --------
    >>> check_ends("field_range", (0, 1))
    (0.0, 1.0)
    """
    low, high = check_array(name, value, (2,))
    if not (np.isfinite(low) and np.isfinite(high) and low <= high):
        raise ParameterError(
            f"{name} must be two finite numbers, the lower one first. Got {told(value)} instead."
        )
    return float(low), float(high)


def check_size(size: object) -> tuple[int, int]:
    """Return width and height of a picture or a window, in pixels.

    Examples
    --------
    >>> check_size(np.array([64, 48]))
    (64, 48)
    """
    sides = size.tolist() if isinstance(size, np.ndarray) else size
    if not isinstance(sides, Sequence) or isinstance(sides, str | bytes) or len(sides) != 2:
        raise ParameterError(f"size must be two whole numbers. Got {told(size)} instead.")
    width, height = (check_whole("size", side, 1, 20_000) for side in sides)
    return width, height


def check_views(name: str, value: object) -> tuple[tuple[float, float], ...]:
    """Return pairs of degrees, at least one."""
    wanted = "pairs of degrees, at least one"
    pairs = as_numbers(name, value, wanted)
    if pairs.ndim != 2 or pairs.shape[1] != 2 or len(pairs) == 0 or not np.isfinite(pairs).all():
        raise ParameterError(f"{name} must be {wanted}. Got {told(value)} instead.")
    return tuple((float(yaw), float(pitch)) for yaw, pitch in pairs)


def check_picture(image: object) -> None:
    """Check that something is a picture with pixels, (height, width, 3) uint8."""
    picture = isinstance(image, np.ndarray) and image.dtype == np.uint8 and image.shape[2:] == (3,)
    if not picture or not isinstance(image, np.ndarray) or image.size == 0:
        found = f"{image.shape} {image.dtype}" if isinstance(image, np.ndarray) else repr(type(image))
        raise ParameterError(f"image must be (height, width, 3) uint8, not empty. Got {found} instead.")
