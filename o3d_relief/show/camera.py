"""The camera of the pictures: orthographic, fitted to a box."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from o3d_relief.array_checks import as_numbers
from o3d_relief.errors import ParameterError
from o3d_relief.param_checks import told

__all__ = ["Camera", "box_corners", "fit_camera", "fit_scale", "unit_vector", "view_direction"]


def view_direction(yaw_degrees: float, pitch_degrees: float = 0.0) -> tuple[float, float, float]:
    """Return the direction from a relief to a camera that stands sideways of it.

    Parameters
    ----------
    yaw_degrees : float
        Angle about the y axis: 0 looks at the relief from the front (from z+), 90 from its right (x+).
    pitch_degrees : float
        Angle above the horizontal plane.

    Examples
    --------
    >>> view_direction(0)
    (0.0, 0.0, 1.0)
    """
    yaw, pitch = np.deg2rad(yaw_degrees), np.deg2rad(pitch_degrees)
    level = np.cos(pitch)
    return (float(np.sin(yaw) * level), float(np.sin(pitch)), float(np.cos(yaw) * level))


@dataclass(frozen=True, kw_only=True, eq=False)
class Camera:
    """An orthographic camera.

    Attributes
    ----------
    axes : (3, 3) float64
        Rows: right, up and the direction to the camera, orthonormal.
    center : (3,) float64
        The point that is drawn at `middle`.
    scale : float
        Pixels per unit of length.
    middle : (x, y)
        In pixels from the upper left corner of the picture; y points down.
    """

    axes: NDArray[np.float64]
    center: NDArray[np.float64]
    scale: float
    middle: tuple[float, float]

    def project(self, points: ArrayLike) -> NDArray[np.float64]:
        """Return x and y in pixels and the nearness of points.

        Parameters
        ----------
        points : (n, 3) float

        Returns
        -------
        (n, 3) float64
            x to the right and y down, in pixels (the centre of the upper left pixel is 0.5, 0.5), and
            the distance towards the camera in the unit of the points.
        """
        local = (np.asarray(points, dtype=np.float64) - self.center) @ self.axes.T
        x = self.middle[0] + self.scale * local[:, 0]
        y = self.middle[1] - self.scale * local[:, 1]
        return np.column_stack([x, y, local[:, 2]])


def view_axes(direction: ArrayLike, up: ArrayLike) -> NDArray[np.float64]:
    """Return right, up and the direction to the camera as orthonormal rows."""
    back = unit_vector("direction", direction)
    upright = unit_vector("up", up)
    right = np.cross(upright, back)
    if np.linalg.norm(right) < 1e-9:  # seen along `up`: any other axis will do
        right = np.cross(np.roll(upright, 1), back)
    right /= np.linalg.norm(right)
    return np.array([right, np.cross(back, right), back])


def unit_vector(name: str, value: ArrayLike) -> NDArray[np.float64]:
    """Check that `value` is a direction and return it with length 1."""
    wanted = "three finite numbers, not all zero"
    vector = as_numbers(name, value, wanted)
    if vector.shape != (3,) or not np.all(np.isfinite(vector)) or not np.any(vector):
        raise ParameterError(f"{name} must be {wanted}. Got {told(value)} instead.")
    return np.asarray(vector / np.linalg.norm(vector))


def box_corners(bounds: ArrayLike) -> NDArray[np.float64]:
    """Check that `bounds` (2, 3) is a box and return its corners (8, 3)."""
    box = np.asarray(bounds, dtype=np.float64)
    if box.shape != (2, 3) or not np.all(np.isfinite(box)) or np.any(box[1] < box[0]):
        raise ParameterError(f"bounds must be two points, least and greatest. Got {told(bounds)} instead.")
    choice = (np.arange(8)[:, None] >> np.arange(3)) & 1
    return np.asarray(np.where(choice == 1, box[1], box[0]))


def fit_scale(bounds: ArrayLike, direction: ArrayLike, up: ArrayLike, area: tuple[float, float]) -> float:
    """Return the greatest scale at which a box fits an area, with a margin of 4 % on each side.

    Parameters
    ----------
    bounds : (2, 3) float
        Least and greatest corner of the box.
    direction, up : (3,) float
        Direction to the camera, and the one that points up in the picture.
    area : (width, height)
        In pixels.

    Returns
    -------
    float
        Pixels per unit of length.

    Examples
    --------
    >>> round(fit_scale([(0, 0, 0), (2, 1, 1)], (0, 0, 1), (0, 1, 0), (100, 100)), 6)
    46.0
    """
    local = box_corners(bounds) @ view_axes(direction, up)[:2].T
    extent = np.maximum(np.ptp(local, axis=0), 1e-300)
    return float(np.min(0.92 * np.asarray(area, dtype=np.float64) / extent))


def fit_camera(
    bounds: ArrayLike,
    *,
    direction: ArrayLike,
    up: ArrayLike,
    area: tuple[float, float, float, float],
    scale: float | None = None,
) -> Camera:
    """Place a camera so that a box lies in the middle of an area of the picture.

    Parameters
    ----------
    bounds : (2, 3) float
        Least and greatest corner of the box.
    direction, up : (3,) float
        Direction to the camera, and the one that points up in the picture.
    area : (left, top, right, bottom)
        In pixels.
    scale : float, optional
        Pixels per unit of length. None: the box fills the area.
    """
    left, top, right, bottom = area
    if scale is None:
        scale = fit_scale(bounds, direction, up, (right - left, bottom - top))
    center = box_corners(bounds).mean(axis=0)
    middle = (0.5 * (left + right), 0.5 * (top + bottom))
    return Camera(axes=view_axes(direction, up), center=center, scale=scale, middle=middle)
