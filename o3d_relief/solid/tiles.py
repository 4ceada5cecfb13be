"""Solids larger than the printer: tiles with pins and holes, numbered on the back."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from o3d_relief.errors import ParameterError
from o3d_relief.solid.body import Solid
from o3d_relief.solid.numerals import engraving
from o3d_relief.solid.plate import as_plate
from o3d_relief.workshop_params import PIN_WALL, TileParams

if TYPE_CHECKING:
    import manifold3d

__all__ = ["Tile", "Tiling", "make_tiles"]

_MOST_TILES = 400
_EVERY = 40.0
"""Millimetres of a joint for each pin."""
_SEGMENTS = 32
"""Sides of a pin."""
_ENGRAVED = 0.4
"""Depth of the numbers in millimetres: two usual layers, less than the wall behind them."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Tile:
    """One tile, in the place that it has in the whole.

    Attributes
    ----------
    number : int
        From 1, by rows from the upper left, seen from the front.
    row, column : int
        From 0, from the upper left.
    solid : Solid
    pins, holes : int
    """

    number: int
    row: int
    column: int
    solid: Solid
    pins: int
    holes: int


@dataclass(frozen=True, kw_only=True, eq=False)
class Tiling:
    """A solid cut into tiles.

    Attributes
    ----------
    tiles : tuple of Tile
        In the order of their numbers; where nothing of the solid is, there is none.
    pin_mm, pin_length_mm : float
        Diameter of the pins and how far they stand out.
    counts : mapping of str to int
        Rows, columns, tiles, joints, pins, joints without room for a pin, tiles without room for a number.
    """

    tiles: tuple[Tile, ...]
    pin_mm: float
    pin_length_mm: float
    counts: Mapping[str, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "counts", MappingProxyType(dict(self.counts)))


@dataclass(frozen=True, kw_only=True)
class _Pins:
    """Sizes of the pins, in millimetres, and the height at which they lie."""

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


def make_tiles(solid: Solid, params: TileParams) -> Tiling:
    """Cut a solid into tiles of equal size that fit a printer.

    Each tile but the rightmost and the uppermost has pins on its right and upper sides, its neighbours the
    holes. They lie in the middle of the plate's thickness, where the material around them is whole.

    Parameters
    ----------
    solid : Solid
        Its back is flat.
    params : TileParams

    Returns
    -------
    Tiling
        One tile, without pins, where the solid fits.

    Raises
    ------
    ParameterError
        Tiles too small for their pins, more than 400 tiles, or pins that fit into none of the joints.
    """
    low, high = solid.vertices.min(axis=0), solid.vertices.max(axis=0)
    pins = _sizes(solid, params)
    columns = _count(high[0] - low[0], params.width_mm, pins.length)
    rows = _count(high[1] - low[1], params.height_mm, pins.length)
    if columns * rows > _MOST_TILES:
        raise ParameterError(
            f"The tiles must be larger: {params.width_mm:g} x {params.height_mm:g} mm makes "
            f"{columns * rows} of them, more than {_MOST_TILES}."
        )
    x, y = np.linspace(low[0], high[0], columns + 1), np.linspace(low[1], high[1], rows + 1)
    whole = solid.to_manifold()
    places = _joints(whole, x, y, pins)
    if places and not any(len(found) for found in places.values()):
        raise ParameterError(
            f"Pins of {2.0 * pins.radius:g} mm that stand out {pins.length:g} mm fit into none of the "
            "joints: make pin_mm smaller, or the base thicker."
        )
    tiles = []
    unnumbered = 0
    for column in range(columns):
        strip = whole ^ _bar(low - 1.0, high + 1.0, 0, x[column : column + 2])
        for row in range(rows):
            body = strip ^ _bar(low - 1.0, high + 1.0, 1, y[row : row + 2])
            if body.is_empty():
                continue
            number = (rows - 1 - row) * columns + column + 1
            added = [
                pins.bolt(place, axis, start=-pins.radius, hole=False)
                for axis in (0, 1)
                for place in places.get((axis, column, row), ())
            ]
            taken = [
                pins.bolt(place, axis, start=-1.0, hole=True)
                for axis, before in ((0, (column - 1, row)), (1, (column, row - 1)))
                for place in places.get((axis, *before), ())
            ]
            count = len(taken)
            if params.number:
                carved = engraving(body, number, depth=_ENGRAVED)
                unnumbered += carved is None
                taken += [] if carved is None else [as_plate(carved)]
            made = _united(_united(body, added, "Add"), taken, "Subtract")
            piece = Solid.from_manifold(made, colored=solid.colors is not None)
            tiles.append(
                Tile(
                    number=number,
                    row=rows - 1 - row,
                    column=column,
                    solid=piece,
                    pins=len(added),
                    holes=count,
                )
            )
    return Tiling(
        tiles=tuple(sorted(tiles, key=lambda tile: tile.number)),
        pin_mm=2.0 * pins.radius,
        pin_length_mm=pins.length,
        counts={
            "rows": rows,
            "columns": columns,
            "tiles": len(tiles),
            "joints": len(places),
            "pins": sum(len(found) for found in places.values()),
            "joints_without_pins": sum(len(found) == 0 for found in places.values()),
            "unnumbered": unnumbered,
        },
    )


def _sizes(solid: Solid, params: TileParams) -> _Pins:
    """Choose the pins: half as thick as the plate, in the middle of it."""
    back = float(solid.vertices[:, 2].min())
    base = max(-back, 0.0)
    diameter = params.pin_for(base)
    length = params.length_of(diameter)
    least = diameter / 2.0 + params.clearance_mm + PIN_WALL
    return _Pins(
        radius=diameter / 2.0, length=length, clearance=params.clearance_mm, z=back + max(base / 2.0, least)
    )


def _count(extent: float, largest: float, length: float) -> int:
    """Return into how many tiles of the largest size, their pins included, an extent is cut."""
    if extent <= largest * (1.0 + 1e-9):
        return 1
    return math.ceil(extent / (largest - length) - 1e-9)


def _joints(
    whole: manifold3d.Manifold, x: NDArray[np.float64], y: NDArray[np.float64], pins: _Pins
) -> dict[tuple[int, int, int], NDArray[np.float64]]:
    """Find the places (p, 3) of the pins on the right (axis 0) and upper (axis 1) side of each tile.

    Keys are axis, column and row. A side at which there is no material on one of its sides is no joint.
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
    whole: manifold3d.Manifold, axis: int, at: float, free: NDArray[np.float64], pins: _Pins
) -> NDArray[np.float64] | None:
    """Choose places along one joint where the material is whole; None where there is no material at all."""
    half, reach = pins.needed, pins.length + pins.clearance + PIN_WALL
    low, high = np.zeros(3), np.zeros(3)
    low[axis], high[axis] = at - reach, at + reach
    low[1 - axis], high[1 - axis] = free
    low[2], high[2] = pins.z - half, pins.z + half
    if free[1] - free[0] < 2.0 * half:
        return np.zeros((0, 3))
    room = _box(low, high)
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
        near[cell] = (gap ^ _bar(low, high, axis, edges[cell : cell + 2])).volume() > 1e-6
    return near


def _runs(good: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return first and last + 1 of each run of True."""
    steps = np.flatnonzero(np.diff(np.concatenate([[0], good.astype(np.int8), [0]])))
    return [(int(a), int(b)) for a, b in steps.reshape(-1, 2)]


def _bar(
    low: NDArray[np.float64], high: NDArray[np.float64], axis: int, between: NDArray[np.float64]
) -> manifold3d.Manifold:
    """Return the box from low to high, but for one axis, which has its own bounds."""
    low, high = low.copy(), high.copy()
    low[axis], high[axis] = between
    return _box(low, high)


def _box(low: NDArray[np.float64], high: NDArray[np.float64]) -> manifold3d.Manifold:
    import manifold3d

    return as_plate(manifold3d.Manifold.cube((high - low).tolist()).translate(low.tolist()))


def _united(body: manifold3d.Manifold, parts: list[manifold3d.Manifold], how: str) -> manifold3d.Manifold:
    import manifold3d

    if not parts:
        return body
    return manifold3d.Manifold.batch_boolean([body, *parts], manifold3d.OpType[how])
