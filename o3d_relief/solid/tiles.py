"""Solids larger than the printer: tiles with pins and holes, numbered on the back."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from o3d_relief.errors import ParameterError
from o3d_relief.frozen import Frozen
from o3d_relief.param_checks import check_kind
from o3d_relief.solid.body import Solid
from o3d_relief.solid.fragments import held
from o3d_relief.solid.joints import Pins, bar, chosen_pins, joints
from o3d_relief.solid.numerals import engraving
from o3d_relief.solid.plate import as_plate
from o3d_relief.workshop_params import TileParams

if TYPE_CHECKING:
    import manifold3d

__all__ = ["Tile", "Tiling", "make_tiles"]

_MOST_TILES = 400
_POCKET_SLICES = (0.98, 0.75, 0.5)
"""Heights, as shares of the plate's thickness, at which pockets are looked for: keyholes are wider inside."""
_LEAST_POCKET = 1.0
"""Square millimetres; smaller ones are rounding errors."""
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
class Tiling(Frozen):
    """A solid cut into tiles.

    Attributes
    ----------
    tiles : tuple of Tile
        In the order of their numbers; where nothing of the solid is, there is none.
    pin_mm, pin_length_mm : float
        Diameter of the pins and how far they stand out.
    counts : mapping of str to int
        Rows, columns, tiles, joints, pins, joints without room for a pin, tiles without room for a number,
        holes in the back that a seam cuts, and loose parts: those that no tile holds.
    """

    tiles: tuple[Tile, ...]
    pin_mm: float
    pin_length_mm: float
    counts: Mapping[str, int] = field(default_factory=dict)


def make_tiles(solid: Solid, params: TileParams) -> Tiling:
    """Cut a solid into tiles of equal size that fit a printer.

    Each tile but the rightmost and the uppermost has pins on its right and upper sides, its neighbours the
    holes. They lie in the middle of the plate's thickness, where the material around them is whole. Parts
    that a cut leaves without hold go with the neighbour that holds them, see `held`.

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
        Tiles too small for their pins, more than 400 tiles, pins that fit into none of the joints, or
        something else than a solid and the sizes of tiles.
    """
    check_kind("solid", solid, Solid, "make_solid")
    check_kind("params", params, TileParams)
    low, high = solid.vertices.min(axis=0), solid.vertices.max(axis=0)
    pins = chosen_pins(float(low[2]), params)
    columns, rows = _grid(high - low, params, pins.length)
    x, y = np.linspace(low[0], high[0], columns + 1), np.linspace(low[1], high[1], rows + 1)
    whole = solid.to_manifold()
    places = joints(whole, x, y, pins)
    if places and not any(len(found) for found in places.values()):
        raise ParameterError(
            f"Pins of {2.0 * pins.radius:g} mm that stand out {pins.length:g} mm fit into none of the "
            "joints: make pin_mm smaller, or the base thicker."
        )
    bodies = _cut_apart(whole, low, high, x, y)
    room = (params.width_mm - pins.length, params.height_mm - pins.length)
    bodies, loose = held(bodies, float(low[2]), room)
    tiles = []
    unnumbered = 0
    for (column, row), body in bodies.items():
        number = (rows - 1 - row) * columns + column + 1
        carved = engraving(body, number, depth=_ENGRAVED) if params.number else None
        unnumbered += params.number and carved is None
        added, taken = _bolts(column, row, places, pins)
        cut = [*taken, *([] if carved is None else [as_plate(carved)])]
        made = _united(_united(body, added, "Add"), cut, "Subtract")
        tiles.append(
            Tile(
                number=number,
                row=rows - 1 - row,
                column=column,
                solid=Solid.from_manifold(made, colored=solid.colors is not None),
                pins=len(added),
                holes=len(taken),
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
            "pockets_cut": _cut_pockets(whole, float(low[2]), x, y),
            "loose": loose,
        },
    )


def _grid(size: NDArray[np.float64], params: TileParams, length: float) -> tuple[int, int]:
    """Return into how many columns and rows a size is cut, for pins of a length; refuse too many."""
    columns = _count(size[0], params.width_mm, length)
    rows = _count(size[1], params.height_mm, length)
    if columns * rows > _MOST_TILES:
        raise ParameterError(
            f"The tiles must be larger: {params.width_mm:g} x {params.height_mm:g} mm makes "
            f"{columns * rows} of them, more than {_MOST_TILES}."
        )
    return columns, rows


def _count(extent: float, largest: float, length: float) -> int:
    """Return into how many tiles of the largest size, their pins included, an extent is cut."""
    if extent <= largest * (1.0 + 1e-9):
        return 1
    return math.ceil(extent / (largest - length) - 1e-9)


def _cut_apart(
    whole: manifold3d.Manifold,
    low: NDArray[np.float64],
    high: NDArray[np.float64],
    x: NDArray[np.float64],
    y: NDArray[np.float64],
) -> dict[tuple[int, int], manifold3d.Manifold]:
    """Cut along x and y; return what is not empty by column and row, from the lower left."""
    bodies = {}
    for column in range(len(x) - 1):
        strip = whole ^ bar(low - 1.0, high + 1.0, 0, x[column : column + 2])
        for row in range(len(y) - 1):
            body = strip ^ bar(low - 1.0, high + 1.0, 1, y[row : row + 2])
            if not body.is_empty():
                bodies[column, row] = body
    return bodies


def _cut_pockets(
    whole: manifold3d.Manifold, back: float, x: NDArray[np.float64], y: NDArray[np.float64]
) -> int:
    """Count the holes in the back that seams run through: half a keyhole pushes two tiles apart."""
    front = whole.slice(0.02 * back)
    pockets = _enclosed(whole.slice(_POCKET_SLICES[0] * back)) ^ front
    for share in _POCKET_SLICES[1:]:
        inner = (_enclosed(whole.slice(share * back)) ^ front).decompose()
        pockets = sum((one for one in inner if (one ^ pockets).area() > _LEAST_POCKET), pockets)
    # Nothing is decomposed into one empty part, without bounds.
    found = [one.bounds() for one in pockets.decompose() if one.area() > _LEAST_POCKET]
    bounds = np.array(found).reshape(-1, 4)
    cut = np.zeros(len(bounds), dtype=bool)
    for axis, seams in enumerate((x[1:-1], y[1:-1])):
        begin, end = bounds[:, axis, None], bounds[:, axis + 2, None]
        cut |= ((begin < seams) & (seams < end)).any(axis=1)
    return int(cut.sum())


def _enclosed(area: manifold3d.CrossSection) -> manifold3d.CrossSection:
    """Return the holes of an area."""
    import manifold3d

    outlines = [ring for ring in area.to_polygons() if manifold3d.CrossSection([ring]).area() > 0.0]
    return manifold3d.CrossSection(outlines, manifold3d.FillRule.Positive) - area


def _bolts(
    column: int, row: int, places: Mapping[tuple[int, int, int], NDArray[np.float64]], pins: Pins
) -> tuple[list[manifold3d.Manifold], list[manifold3d.Manifold]]:
    """Return the pins and the holes of a tile."""
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
    return added, taken


def _united(body: manifold3d.Manifold, parts: list[manifold3d.Manifold], how: str) -> manifold3d.Manifold:
    import manifold3d

    if not parts:
        return body
    return manifold3d.Manifold.batch_boolean([body, *parts], manifold3d.OpType[how])
