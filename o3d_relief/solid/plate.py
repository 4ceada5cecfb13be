"""The plate: its outline, its frame and what it hangs from."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from o3d_relief.errors import ParameterError
from o3d_relief.plate_params import PlateParams
from o3d_relief.solid.body import PLATE_COLOR

if TYPE_CHECKING:
    import manifold3d

__all__ = ["as_plate", "outline", "plate", "pockets"]

_SEGMENTS = 256
"""Corners of a full circle: at a radius of 100 mm it is 0.008 mm off the true one."""
_HEAD, _SHANK, _LIP, _SLOT = 8.5, 4.2, 1.5, 8.0
"""Millimetres: the keyhole's room for a screw's head, its slot, the lip that the head grips, the way up."""


def outline(silhouette: manifold3d.CrossSection, params: PlateParams) -> manifold3d.CrossSection:
    """Return the outline of the plate, frame included.

    Parameters
    ----------
    silhouette : CrossSection
        The relief as it is seen from the front, in millimetres, its extents centred on the origin.
    params : PlateParams
        Any shape but "none".

    Returns
    -------
    CrossSection
        One simple polygon, exactly `width_mm` wide.
    """
    import manifold3d

    low_x, low_y, high_x, high_y = silhouette.bounds()
    half = np.array([high_x - low_x, high_y - low_y]) / 2.0
    if params.shape == "contour":
        return _contour(silhouette, params)
    if params.shape == "ellipse":
        points = np.concatenate(silhouette.to_polygons())
        half = half * np.sqrt(((points / half) ** 2).sum(axis=1).max())
    half += params.edge_mm
    half *= [params.width_mm / 2.0 / half[0], 1.0]
    if params.shape == "ellipse":
        return manifold3d.CrossSection.circle(1.0, _SEGMENTS).scale(tuple(half))
    return manifold3d.CrossSection.square(tuple(2.0 * half), center=True)


def _contour(silhouette: manifold3d.CrossSection, params: PlateParams) -> manifold3d.CrossSection:
    """Follow the silhouette at a distance, over what is apart and what is hollow."""
    reach = max(params.edge_mm, 0.01)
    extra = 0.0
    while True:
        wide = _filled(_offset(silhouette, reach + extra))
        result = _filled(_offset(wide, -extra)) if extra > 0.0 else wide
        if result.num_contour() == 1:
            break
        extra = max(2.0 * extra, 1.0)  # far parts: the gap between them is closed, too
    result = result.simplify(0.002)
    low_x, _, high_x, _ = result.bounds()
    return result.translate((-(low_x + high_x) / 2.0, 0.0)).scale((params.width_mm / (high_x - low_x), 1.0))


def _filled(section: manifold3d.CrossSection) -> manifold3d.CrossSection:
    import manifold3d

    outer = [polygon for polygon in section.to_polygons() if _area(polygon) > 0.0]
    return manifold3d.CrossSection(outer, manifold3d.FillRule.NonZero)


def _area(polygon: NDArray[np.float64]) -> float:
    x, y = polygon.T
    return float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum()) / 2.0


def _offset(section: manifold3d.CrossSection, distance: float) -> manifold3d.CrossSection:
    import manifold3d

    return section.offset(distance, manifold3d.JoinType.Round, circular_segments=_SEGMENTS)


def as_plate(body: manifold3d.Manifold) -> manifold3d.Manifold:
    """Give a body the properties of the plate, see `manifold_of`."""
    values = np.array([*PLATE_COLOR, 1.0])
    paint: Callable[[object, object], object] = lambda _place, _old: values  # noqa: E731
    return body.set_properties(4, paint)


def plate(shape: manifold3d.CrossSection, params: PlateParams) -> manifold3d.Manifold:
    """Return the plate with its frame: its front is z = 0, its back z = -base.

    Parameters
    ----------
    shape : CrossSection
        The outline.
    params : PlateParams
    """
    import manifold3d

    body = manifold3d.Manifold.extrude(shape, params.base_mm).translate((0.0, 0.0, -params.base_mm))
    if params.frame_mm > 0.0:
        height = params.frame_mm if params.frame_height_mm is None else params.frame_height_mm
        rim = shape - _offset(shape, -params.frame_mm)
        sunk = params.base_mm / 2.0
        body += manifold3d.Manifold.extrude(rim, height + sunk).translate((0.0, 0.0, -sunk))
    return as_plate(body)


def pockets(shape: manifold3d.CrossSection, params: PlateParams) -> manifold3d.Manifold:
    """Return what is cut out of the back so that the plate can hang.

    A keyhole lies above the middle of the plate's area, so that it hangs straight; magnets lie in up to four
    corners.

    Parameters
    ----------
    shape : CrossSection
        The outline.
    params : PlateParams
        With a hanging.

    Raises
    ------
    ParameterError
        The plate is too small.
    """
    import manifold3d

    radius = (_HEAD if params.hanging == "keyhole" else params.magnet_mm + 0.2) / 2.0
    room = _offset(shape, -(radius + max(2.0 * params.min_wall_mm, 2.0)))
    if room.is_empty():
        raise ParameterError(f"The plate is too small for hanging={params.hanging!r}: make it wider.")
    corners = np.concatenate(room.to_polygons())
    if params.hanging == "magnets":
        signs = np.array([(-1.0, 1.0), (1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)])
        places = np.unique(corners[(corners @ signs.T).argmax(axis=0)], axis=0)
        disc = manifold3d.CrossSection.circle(radius, _SEGMENTS)
        spots = manifold3d.CrossSection.batch_boolean(
            [disc.translate(tuple(place)) for place in places], manifold3d.OpType.Add
        )
        return as_plate(_from_back(spots, params, 0.0, params.pocket_mm))
    x, y = _hook(room, shape)
    head = manifold3d.CrossSection.circle(_HEAD / 2.0, _SEGMENTS).translate((x, y - _SLOT))
    shank = manifold3d.CrossSection.circle(_SHANK / 2.0, _SEGMENTS).translate((x, y))
    way = manifold3d.CrossSection.square((_SHANK, _SLOT)).translate((x - _SHANK / 2.0, y - _SLOT))
    top = manifold3d.CrossSection.circle(_HEAD / 2.0, _SEGMENTS).translate((x, y))
    inner = (
        top + head + manifold3d.CrossSection.square((_HEAD, _SLOT)).translate((x - _HEAD / 2.0, y - _SLOT))
    )
    if not (inner - shape).is_empty():
        raise ParameterError("The plate is too small for hanging='keyhole': make it wider.")
    cut = _from_back(head + shank + way, params, 0.0, params.pocket_mm)
    return as_plate(cut + _from_back(inner, params, _LIP, params.pocket_mm))


def _hook(room: manifold3d.CrossSection, shape: manifold3d.CrossSection) -> tuple[float, float]:
    """Find the highest place in the room above the middle of the shape's area."""
    import manifold3d

    polygon = shape.to_polygons()[0]
    x, y = polygon.T
    cross = x * np.roll(y, -1) - y * np.roll(x, -1)
    middle = float(((x + np.roll(x, -1)) * cross).sum() / (3.0 * cross.sum()))
    low_x, low_y, high_x, high_y = room.bounds()
    middle = min(max(middle, low_x + 0.01), high_x - 0.01)
    strip = manifold3d.CrossSection.square((0.01, high_y - low_y + 2.0)).translate((middle, low_y - 1.0))
    return middle, room.__xor__(strip).bounds()[3]


def _from_back(
    section: manifold3d.CrossSection, params: PlateParams, start: float, end: float
) -> manifold3d.Manifold:
    """Extrude between two depths from the back; from a millimetre outside where the first is 0."""
    import manifold3d

    low = -1.0 if start == 0.0 else start
    return manifold3d.Manifold.extrude(section, end - low).translate((0.0, 0.0, low - params.base_mm))
