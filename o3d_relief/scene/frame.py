"""The relief frame: S is z = 0, x to the right, y up, z towards the viewer; 100 units wide or high."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from o3d_relief.errors import MeshError

__all__ = ["RELIEF_UNITS", "Frame", "relief_frame", "to_relief_units"]

RELIEF_UNITS = 100.0
"""The larger of the scene's x and y extents in relief units."""

_GRID = 2.0**20
"""Steps per relief unit of the grid to which solver coordinates are rounded (1e-8 of the extent).

A scene that is moved, turned and scaled differs by rounding errors only. On the grid these errors
vanish, so that every decision (what is visible, which cluster, which point) is the same.
"""

_EDGE_ON = 1e-9
"""Scenes narrower than this share of their size are lines."""


_CLEARLY_WIDE = 1e-5
"""From this share on the width need not be computed more accurately."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Frame:
    """Where the relief frame lies in the input's frame.

    Attributes
    ----------
    rotation : (3, 3) float64
        Rows are the relief's x, y and z axes in the input's frame.
    origin : (3,) float64
        The centre of S in the input's frame.
    unit : float
        Length of one relief unit in the input's unit.
    """

    rotation: NDArray[np.float64]
    origin: NDArray[np.float64]
    unit: float

    @property
    def to_scene(self) -> NDArray[np.float64]:
        """(4, 4) matrix from the relief frame, in the input's unit, to the input's frame."""
        matrix = np.eye(4)
        matrix[:3, :3] = self.rotation.T
        matrix[:3, 3] = self.origin
        return matrix


def _axes(front: tuple[float, float, float], up: tuple[float, float, float]) -> NDArray[np.float64]:
    z = np.asarray(front, dtype=np.float64)
    z = z / np.linalg.norm(z)
    x = np.cross(np.asarray(up, dtype=np.float64), z)
    x = x / np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z])


def _turned(points: NDArray[np.float64], rotation: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return points (n, 3) in other axes; column by column, on one thread."""
    x, y, z = np.ascontiguousarray(points.T)
    return np.stack([axis[0] * x + axis[1] * y + axis[2] * z for axis in rotation], axis=1)


def _corners(points: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the lower and the upper corner of the box around points (n, 3)."""
    return np.array([axis.min() for axis in points.T]), np.array([axis.max() for axis in points.T])


def _width(across: NDArray[np.float64]) -> float:
    """Return how far points (n, 2) spread across the line that fits them best, per point."""
    x, y = (column - column.mean() for column in across.T)
    xx, xy, yy = float((x * x).mean()), float((x * y).mean()), float((y * y).mean())
    square = float(np.linalg.eigvalsh(np.array([[xx, xy], [xy, yy]])).min())
    if square > _CLEARLY_WIDE**2:
        return float(np.sqrt(square))
    spread = np.linalg.qr(np.stack([x, y], axis=1), mode="r")  # its squares would vanish in rounding errors
    return float(np.linalg.svd(spread, compute_uv=False).min() / np.sqrt(len(across)))


def relief_frame(
    vertices: NDArray[np.float64],
    front: tuple[float, float, float] = (0.0, 0.0, 1.0),
    up: tuple[float, float, float] = (0.0, 1.0, 0.0),
) -> Frame:
    """Put the relief plane behind a scene.

    Parameters
    ----------
    vertices : (n, 3) float64
        Vertices in the input's frame and unit; all of them count.
    front : three floats
        Direction from the scene to the viewer.
    up : three floats
        Direction that points up; not parallel to `front`.

    Returns
    -------
    Frame
        S touches the rearmost vertex; x and y are centred on the scene's extents.

    Raises
    ------
    MeshError
        From `front` all vertices lie on one line or point.

    Examples
    --------
    >>> frame = relief_frame(np.array([[0, 0, 1], [4, 0, 1], [4, 2, 3.0]]))
    >>> frame.unit, frame.origin.tolist()
    (0.04, [2.0, 1.0, 1.0])
    """
    rotation = _axes(front, up)
    lowest, highest = _corners(vertices)
    middle = (lowest + highest) / 2
    turned = _turned(vertices - middle, rotation)
    low, high = _corners(turned)
    unit = float((high - low)[:2].max()) / RELIEF_UNITS
    size = float(np.maximum(highest - middle, middle - lowest).max())
    if size == 0.0 or _width(turned[:, :2] / size) <= _EDGE_ON:
        raise MeshError(
            "The scene is seen edge-on: all its vertices lie on one line as seen from the front "
            f"({', '.join(f'{c:g}' for c in front)}): choose another front."
        )
    centre = (low + high) / 2
    origin = middle + rotation.T @ np.array([centre[0], centre[1], low[2]])
    return Frame(rotation=rotation, origin=origin, unit=unit)


def to_relief_units(
    vertices: NDArray[np.float64], frame: Frame, *, on_grid: bool = False
) -> NDArray[np.float64]:
    """Bring vertices into the relief frame, in relief units.

    Parameters
    ----------
    vertices : (n, 3) float64
        Vertices in the input's frame and unit.
    frame : Frame
    on_grid : bool
        Round to a grid of 2^-20 relief units, 1e-8 of the extent.

    Returns
    -------
    (n, 3) float64
    """
    moved = _turned(vertices - frame.origin, frame.rotation)
    moved /= frame.unit
    if on_grid:
        moved *= _GRID
        np.rint(moved, out=moved)
        moved /= _GRID
    return moved
