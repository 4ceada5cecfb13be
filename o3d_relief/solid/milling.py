"""What a mill can cut: walls with a draft, hollows that a ball end tool can enter."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import grey_dilation, grey_erosion

from o3d_relief.errors import ParameterError
from o3d_relief.param_checks import check_kind
from o3d_relief.solid.heights import HeightField
from o3d_relief.workshop_params import MillParams

__all__ = ["ball_closing", "ball_opening", "draft", "milled"]

_CONE_PIXELS = 8
"""Radius of the cone that the draft uses again and again: its directions are then even to 0.5 %."""
_STRETCH = 1.1
"""A tip that is lost is made up for by stretching the relief by at most this."""


def milled(field: HeightField, params: MillParams) -> HeightField:
    """Change a height field into one that a mill can cut from the front.

    Ridges are rounded first (but for `keep_ridges`), then walls get their draft, then the hollows that
    the tool cannot enter are filled, so that this holds exactly at the end. What lies in front of the relief
    plane is stretched a little after the first step, so that the piece keeps its depth; not where a tip
    of more than a tenth of the depth is lost.

    Parameters
    ----------
    field : HeightField
    params : MillParams

    Returns
    -------
    HeightField

    Raises
    ------
    ParameterError
        A tool larger than the piece, or something else than a height field and the parameters of a mill.
    """
    check_kind("field", field, HeightField, "height_field")
    check_kind("params", params, MillParams)
    z, pixel = field.z, field.mm_per_pixel
    extents = [along * pixel for along in z.shape]
    if params.tool_mm > min(extents):
        raise ParameterError(
            f"tool_mm must be smaller than the piece, {extents[1]:g} x {extents[0]:g} mm. "
            f"Got {params.tool_mm:g} instead."
        )
    radius = params.tool_mm / 2.0
    if params.tool_mm > 0.0 and not params.keep_ridges:
        z = ball_opening(z, radius, pixel)
    z = _stretched(z, field.highest)
    if params.draft_deg > 0.0:
        z = draft(z, params.draft_deg, pixel)
    if params.tool_mm > 0.0:
        z = ball_closing(z, radius, pixel)
    return field.with_heights(z)


def _stretched(z: NDArray[np.float64], highest: float) -> NDArray[np.float64]:
    """Scale what lies in front of the relief plane, so that the highest pixel is as high as it should be."""
    found = float(np.nanmax(z))
    if not 0.0 < found < highest <= found * _STRETCH:
        return z
    return np.where(z > 0.0, z * (highest / found), z)


def ball_closing(z: NDArray[np.float64], radius: float, pixel: float) -> NDArray[np.float64]:
    """Fill what a ball that rolls over the surface cannot touch (grey-scale closing).

    It is the surface that a ball end tool of this radius leaves when it cuts as much as it may. Beside the
    piece the tool has free space.

    Parameters
    ----------
    z : (rows, columns) float64
        Heights in millimetres; NaN beside the piece.
    radius : float
        Of the ball, in millimetres.
    pixel : float
        Size of a pixel in millimetres.

    Returns
    -------
    (rows, columns) float64
        Nowhere lower than `z`.

    Examples
    --------
    A groove of one pixel, 10 deep: a ball of radius 5 sinks in by 5 - sqrt(24) only.

    >>> z = np.zeros((9, 9))
    >>> z[:, 4] = -10.0
    >>> float(ball_closing(z, 5.0, 1.0)[4, 4].round(6))
    -0.101021
    """
    return _rolled(z, radius, pixel, beside=True)


def ball_opening(z: NDArray[np.float64], radius: float, pixel: float) -> NDArray[np.float64]:
    """Round what is sharper than a ball that rolls below the surface (grey-scale opening).

    The ball stays below the piece: its edge remains as it is, but for ridges that end there.

    Parameters
    ----------
    z : (rows, columns) float64
        Heights in millimetres; NaN beside the piece.
    radius : float
        Of the ball, in millimetres.
    pixel : float
        Size of a pixel in millimetres.

    Returns
    -------
    (rows, columns) float64
        Nowhere higher than `z`.

    Examples
    --------
    >>> z = np.zeros((9, 9))
    >>> z[:, 4] = 10.0
    >>> float(ball_opening(z, 5.0, 1.0)[4, 4].round(6))
    0.101021
    """
    return -_rolled(-z, radius, pixel, beside=False)


def _rolled(z: NDArray[np.float64], radius: float, pixel: float, *, beside: bool) -> NDArray[np.float64]:
    """Close z (rows, columns) with a ball whose centre may, or may not, lie beside the piece."""
    ball, wide = _ball(radius, pixel)
    footprint = np.isfinite(ball)
    shape = np.where(footprint, ball, 0.0)
    outside = np.pad(np.isnan(z), wide, constant_values=True)
    padded = np.where(outside, -np.inf, np.pad(z, wide))
    center = grey_dilation(padded, footprint=footprint, structure=shape, mode="constant", cval=-np.inf)
    if not beside:
        center = np.where(outside, np.inf, center)
    rolled = grey_erosion(center, footprint=footprint, structure=shape, mode="constant", cval=np.inf)
    # Rounding must not lower anything.
    return np.where(np.isnan(z), np.nan, np.maximum(rolled[wide:-wide, wide:-wide], z))


def draft(z: NDArray[np.float64], angle: float, pixel: float) -> NDArray[np.float64]:
    """Fill the foot of every wall that is steeper than the draft allows.

    The lowest surface that lies nowhere below `z` and whose slope is at most 1 / tan(angle) between any two
    pixels that are up to eight pixels apart: `z` is dilated with a cone until nothing changes.

    Parameters
    ----------
    z : (rows, columns) float64
        Heights in millimetres; NaN beside the piece, whose outer sides stay as they are.
    angle : float
        From the direction of sight, in degrees, between 0 and 60.
    pixel : float
        Size of a pixel in millimetres.

    Returns
    -------
    (rows, columns) float64

    Examples
    --------
    A step of 10 at 45 degrees becomes a slope.

    >>> z = np.zeros((1, 6))
    >>> z[0, 0] = 3.0
    >>> draft(z, 45.0, 1.0).round(6).tolist()
    [[3.0, 2.0, 1.0, 0.0, 0.0, 0.0]]
    """
    slope = 1.0 / math.tan(math.radians(angle))
    reach = math.ceil(float(np.nanmax(z) - np.nanmin(z)) / (slope * pixel))
    wide = max(1, min(_CONE_PIXELS, reach))
    distance = np.hypot(*np.mgrid[-wide : wide + 1, -wide : wide + 1]) * pixel
    footprint = distance <= wide * pixel
    cone = np.where(footprint, -slope * distance, 0.0)
    outside = np.isnan(z)
    raised = np.where(outside, -np.inf, z)
    for _ in range(math.ceil(reach / wide) + 1):
        before = raised
        raised = grey_dilation(before, footprint=footprint, structure=cone, mode="constant", cval=-np.inf)
        raised = np.where(outside, -np.inf, raised)
        if np.array_equal(raised, before):
            break
    return np.where(outside, np.nan, raised)


def _ball(radius: float, pixel: float) -> tuple[NDArray[np.float64], int]:
    """Return the upper half of a ball, 0 at its rim, -inf beside it, and its radius in pixels."""
    wide = max(1, math.floor(radius / pixel + 1e-9))
    squares = (np.mgrid[-wide : wide + 1, -wide : wide + 1] * pixel) ** 2
    rest = radius**2 - squares.sum(axis=0)
    return np.where(rest >= -1e-9 * radius**2, np.sqrt(np.maximum(rest, 0.0)), -np.inf), wide
