"""Where two tiles meet: the pins, and the places where the material around them is whole."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from o3d_relief.solid.plate import as_plate
from o3d_relief.workshop_params import PIN_WALL, TileParams

if TYPE_CHECKING:
    import manifold3d

__all__ = ["Pins", "bar", "box", "chosen_pins", "joints"]

_EVERY = 40.0
"""Millimetres of a joint for each pin."""
_SEGMENTS = 32
"""Sides of a pin."""


@dataclass(frozen=True, kw_only=True)
class Pins:
    """Sizes of the pins, in millimetres, and the height at which they lie.

    Attributes
    ----------
    radius, length : float
    clearance : float
        Between a pin and its hole.
    z : float
        Of the pins' axes.
    """

    radius: float
    length: float
    clearance: float
    z: float

    @property
    def needed(self) -> float:
        """Half the width of the material that a hole needs."""
        return self.radius + self.clearance + PIN_WALL

    def bolt(self, place: NDArray[np.float64], axis: int, *, start: float, hole: bool) -> manifold3d.Manifold:
        """Return a pin at a place (3,) of a joint across an axis, or its hole, from `start` on."""
        import manifold3d

        extra = self.clearance if hole else 0.0
        # The flat sides, not the edges, of a hole keep the clearance.
        radius = (self.radius + extra) / (math.cos(math.pi / _SEGMENTS) if extra else 1.0)
        end, tip = self.length + extra, 0.3 * self.radius
        outline = [(0.0, start), (radius, start), (radius, end - tip), (radius - tip, end), (0.0, end)]
        standing = manifold3d.CrossSection([outline]).revolve(_SEGMENTS)  # along z
        turned = standing.rotate([0.0, 90.0, 0.0] if axis == 0 else [-90.0, 0.0, 0.0])
        return as_plate(turned.translate(place.tolist()))


def chosen_pins(back: float, params: TileParams) -> Pins:
    """Choose the pins: half as thick as the plate, in the middle of it.

    Parameters
    ----------
    back : float
        z of the solid's back: the thickness of its plate, or not less than 0 without one.
    params : TileParams

    Raises
    ------
    ParameterError
        A plate too thin for the pins, or a tile too small.
    """
    base = max(-back, 0.0)
    diameter = params.pin_for(base)
    length = params.length_of(diameter)
    least = diameter / 2.0 + params.clearance_mm + PIN_WALL
    return Pins(
        radius=diameter / 2.0, length=length, clearance=params.clearance_mm, z=back + max(base / 2.0, least)
    )


def joints(
    whole: manifold3d.Manifold, x: NDArray[np.float64], y: NDArray[np.float64], pins: Pins
) -> dict[tuple[int, int, int], NDArray[np.float64]]:
    """Find the places of the pins on the right (axis 0) and upper (axis 1) side of each tile.

    Parameters
    ----------
    whole : manifold3d.Manifold
    x, y : (columns + 1,) and (rows + 1,) float64
        Where it is cut, its own bounds included.
    pins : Pins

    Returns
    -------
    dict of (axis, column, row) to (p, 3) float64
        Rows from below. A side at which there is no material is no joint.
    """
    places: dict[tuple[int, int, int], NDArray[np.float64]] = {}
    cuts = (x, y)
    for axis in (0, 1):
        across, along = cuts[axis], cuts[1 - axis]
        for i, at in enumerate(across[1:-1]):
            for j, (start, end) in enumerate(pairwise(along)):
                # Away from the corners, where pins of two directions would meet.
                corner = pins.length + pins.clearance + pins.needed
                free = np.array([start + corner * (j > 0), end - corner * (j < len(along) - 2)])
                found = _free_places(whole, axis, at, free, pins)
                if found is not None:
                    key = (axis, i, j) if axis == 0 else (axis, j, i)
                    places[key] = found
    return places


def _free_places(
    whole: manifold3d.Manifold, axis: int, at: float, free: NDArray[np.float64], pins: Pins
) -> NDArray[np.float64] | None:
    """Choose places along one joint where the material is whole; None where there is no material at all."""
    half, reach = pins.needed, pins.length + pins.clearance + PIN_WALL
    low, high = np.zeros(3), np.zeros(3)
    low[axis], high[axis] = at - reach, at + reach
    low[1 - axis], high[1 - axis] = free
    low[2], high[2] = pins.z - half, pins.z + half
    if free[1] - free[0] < 2.0 * half:
        return np.zeros((0, 3))
    room = box(low, high)
    gaps = room - whole
    if gaps.volume() > (1.0 - 1e-6) * room.volume():
        return None
    cells = math.floor((free[1] - free[0]) / (2.0 * half))
    edges = np.linspace(free[0], free[1], cells + 1)
    blocked = np.zeros(cells, dtype=bool)
    for gap in gaps.decompose():
        if gap.volume() > 1e-6:
            blocked |= _met(gap, low, high, 1 - axis, edges)
    place = np.zeros(3)
    place[axis], place[2] = at, pins.z
    chosen = []
    for first, last in _runs(~blocked):
        length = edges[last] - edges[first]
        number = max(round(length / _EVERY), 2 if last - first > 3 else 1)
        for k in range(number):
            place[1 - axis] = edges[first] + (k + 0.5) * length / number
            chosen.append(place.copy())
    return np.array(chosen).reshape(-1, 3)


def _met(
    gap: manifold3d.Manifold,
    low: NDArray[np.float64],
    high: NDArray[np.float64],
    axis: int,
    edges: NDArray[np.float64],
) -> NDArray[np.bool_]:
    """Tell which cells between the edges (c + 1,) along an axis hold some of a gap."""
    bounds = gap.bounding_box()
    near: NDArray[np.bool_] = (edges[1:] > bounds[axis]) & (edges[:-1] < bounds[axis + 3])
    for cell in np.flatnonzero(near):
        near[cell] = (gap ^ bar(low, high, axis, edges[cell : cell + 2])).volume() > 1e-6
    return near


def _runs(good: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return first and last + 1 of each run of True."""
    steps = np.flatnonzero(np.diff(np.concatenate([[0], good.astype(np.int8), [0]])))
    return [(int(a), int(b)) for a, b in steps.reshape(-1, 2)]


def bar(
    low: NDArray[np.float64], high: NDArray[np.float64], axis: int, between: NDArray[np.float64]
) -> manifold3d.Manifold:
    """Return the box from low to high, but for one axis, which has its own bounds.

    Parameters
    ----------
    low, high : (3,) float64
    axis : int
    between : (2,) float64
    """
    low, high = low.copy(), high.copy()
    low[axis], high[axis] = between
    return box(low, high)


def box(low: NDArray[np.float64], high: NDArray[np.float64]) -> manifold3d.Manifold:
    """Return the box from low (3,) to high (3,), a part of the plate."""
    import manifold3d

    return as_plate(manifold3d.Manifold.cube((high - low).tolist()).translate(low.tolist()))
