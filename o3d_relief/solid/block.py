"""The solid under a height field: no undercuts."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from o3d_relief.limits import check_field
from o3d_relief.param_checks import check_kind
from o3d_relief.solid.body import PLATE_COLOR, Solid
from o3d_relief.solid.heights import HeightField
from o3d_relief.solid.plate import as_plate

__all__ = ["solid_under"]


def solid_under(field: HeightField, solid: Solid) -> Solid:
    """Return the solid between a height field and the back, with the outline of another solid.

    Parameters
    ----------
    field : HeightField
    solid : Solid
        The one that the field was taken of: its outline, seen from the front, is cut out exactly, so that
        the size does not depend on the pixels. Its back becomes flat, without pockets.

    Returns
    -------
    Solid
        Every line along z meets it once.

    Raises
    ------
    ParameterError
        Something else than a height field and a solid, or too little memory for so many pixels.
    """
    check_kind("field", field, HeightField, "height_field")
    check_kind("solid", solid, Solid, "make_solid")
    import manifold3d

    rows, columns = field.z.shape
    check_field(columns, rows, field.mm_per_pixel, solid=True)
    thickness = float(np.nanmax(field.z)) - field.back + 1.0
    shadow = solid.to_manifold().project().to_polygons()  # polygons that overlap
    outline = manifold3d.CrossSection(shadow, manifold3d.FillRule.Positive)
    prism = as_plate(outline.extrude(thickness).translate((0.0, 0.0, field.back)))
    made = _block(field).to_manifold() ^ prism
    if field.colors is None:
        # What is flat to a hundredth of a pixel needs no triangles; colours would be lost with them.
        made = made.simplify(0.01 * field.mm_per_pixel)
    return Solid.from_manifold(made, colored=field.colors is not None)


def _block(field: HeightField) -> Solid:
    """Close the field to a block that is a pixel wider on each side and reaches below the back.

    Beside the piece it has the height of the nearest pixel.
    """
    nearest = distance_transform_edt(~field.inside, return_distances=False, return_indices=True)
    spread = np.pad(np.ravel_multi_index(tuple(nearest), field.z.shape), 1, mode="edge").ravel()
    rows, columns = field.z.shape[0] + 2, field.z.shape[1] + 2
    x = field.left + (np.arange(columns) - 0.5) * field.mm_per_pixel
    y = field.top - (np.arange(rows) - 0.5) * field.mm_per_pixel
    z = field.z.ravel()[spread]
    surface = np.stack([np.tile(x, rows), np.repeat(y, columns), z], axis=1)

    number = np.arange(rows * columns).reshape(rows, columns)
    top = _top(number, z)
    # Counterclockwise seen from the front, as the top is.
    ring = np.concatenate([number[:-1, 0], number[-1, :-1], number[:0:-1, -1], number[0, :0:-1]])
    sides = _sides(ring, len(surface))
    low = field.back - 1.0
    floor = np.column_stack([surface[ring, :2], np.full(len(ring), low)])
    middle = [[(x[0] + x[-1]) / 2, (y[0] + y[-1]) / 2, low]]
    own = ~field.is_plate.ravel()[spread]
    colors = None
    if field.colors is not None:
        plain = np.tile(np.array(PLATE_COLOR), (len(ring) + 1, 1))
        colors = np.concatenate([field.colors.reshape(-1, 3)[spread], plain])
    return Solid(
        vertices=np.concatenate([surface, floor, middle]),
        faces=np.concatenate([top, sides]),
        colors=colors,
        is_plate=np.concatenate([~own[top].any(axis=1), np.ones(len(sides), dtype=bool)]),
    )


def _top(number: NDArray[np.int64], z: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return two triangles for each square of four neighbouring numbers."""
    a, b = number[:-1, :-1].ravel(), number[1:, :-1].ravel()
    c, d = number[1:, 1:].ravel(), number[:-1, 1:].ravel()
    along = (np.abs(z[a] - z[c]) <= np.abs(z[b] - z[d]))[:, None]  # the flatter diagonal follows an edge
    return np.concatenate(
        [
            np.where(along, np.stack([a, b, c], 1), np.stack([a, b, d], 1)),
            np.where(along, np.stack([a, c, d], 1), np.stack([b, c, d], 1)),
        ]
    )


def _sides(ring: NDArray[np.int64], first: int) -> NDArray[np.int64]:
    """Return the walls below a ring, and the floor around its middle; their own vertices begin at `first`."""
    below = first + np.arange(len(ring))
    after, below_after = np.roll(ring, -1), np.roll(below, -1)
    center = np.full(len(ring), first + len(ring))
    return np.concatenate(
        [
            np.stack([ring, below, below_after], 1),
            np.stack([ring, below_after, after], 1),
            np.stack([below, center, below_after], 1),
        ]
    )
