"""The upper envelope of a solid, seen from the front, and the solid under it: no undercuts."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
import open3d as o3d
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from o3d_relief.errors import ParameterError
from o3d_relief.limits import check_field
from o3d_relief.rays import unit_box
from o3d_relief.solid.body import PLATE_COLOR, Solid
from o3d_relief.solid.plate import as_plate

__all__ = ["HeightField", "check_pixels", "height_field", "solid_under"]

_RAYS_AT_ONCE = 2_000_000


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class HeightField:
    """Heights on a grid of square pixels, seen from the front.

    Row 0 is the top. The centre of pixel (i, j) lies at x = left + (j + 1/2) mm_per_pixel,
    y = top - (i + 1/2) mm_per_pixel. Arrays are read-only.

    Attributes
    ----------
    z : (rows, columns) float64
        In millimetres, in the relief's frame; NaN beside the piece.
    colors : (rows, columns, 3) float64, optional
        sRGB, from 0 to 1.
    is_plate : (rows, columns) bool
        Pixels that do not show the relief's own surface.
    mm_per_pixel : float
    left, top : float
        In millimetres.
    back : float
        z of the flat back.
    highest : float
        z of the highest point of the solid, which may lie between the pixels.
    """

    z: NDArray[np.float64]
    colors: NDArray[np.float64] | None = None
    is_plate: NDArray[np.bool_]
    mm_per_pixel: float
    left: float
    top: float
    back: float
    highest: float

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            if isinstance(value, np.ndarray):
                frozen = value.view()  # the caller's own array stays as it is
                frozen.flags.writeable = False
                object.__setattr__(self, item.name, frozen)

    def __repr__(self) -> str:
        rows, columns = self.z.shape
        return f"<HeightField: {columns} x {rows} pixels of {self.mm_per_pixel:g} mm>"

    @property
    def inside(self) -> NDArray[np.bool_]:
        """(rows, columns) True where the piece is."""
        return np.asarray(np.isfinite(self.z))

    def with_heights(self, z: NDArray[np.float64]) -> HeightField:
        """Return a copy with other heights (rows, columns), NaN where they are not finite."""
        return replace(self, z=np.where(np.isfinite(z), z, np.nan))


def check_pixels(
    width: float, height: float, mm_per_pixel: float, *, about: bool = False, solid: bool = False
) -> tuple[int, int]:
    """Return the columns and rows of the height field of a piece, and refuse too many.

    Parameters
    ----------
    width, height : float
        Of the piece, in millimetres.
    mm_per_pixel : float
    about : bool
        Whether the size is an estimate, which the sentence then says.
    solid : bool
        Whether a solid is to be made of what lies under the field.

    Raises
    ------
    ParameterError
        More than 40 million pixels, or too little memory for them.
    """
    columns, rows = (max(1, int(np.ceil(side / mm_per_pixel - 1e-9))) for side in (width, height))
    check_field(columns, rows, mm_per_pixel, about=about, solid=solid)
    return columns, rows


def height_field(solid: Solid, mm_per_pixel: float) -> HeightField:
    """Look at a solid from the front: the first surface that a ray along -z meets.

    Rays are float32; heights and colours are interpolated on the triangle that is hit, so a flat plate
    stays exactly flat.

    Parameters
    ----------
    solid : Solid
    mm_per_pixel : float
        Greater than 0.

    Returns
    -------
    HeightField
        Centred on the solid, as many whole pixels as cover it.

    Raises
    ------
    ParameterError
        Pixels so small that there are more than 40 million, or larger than the piece.

    Examples
    --------
    >>> from o3d_relief.solid.body import manifold_of
    >>> v = np.array([[0, 0, 0], [3, 0, 0], [0, 3, 0], [0, 0, 3.0]])
    >>> f = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    >>> corner = Solid.from_manifold(manifold_of(v, f, is_plate=False), colored=False)
    >>> height_field(corner, 1.0).z[2, :2].round(6).tolist()
    [2.0, 1.0]
    """
    low, high = solid.vertices.min(axis=0), solid.vertices.max(axis=0)
    width, height, _ = high - low
    columns, rows = check_pixels(width, height, mm_per_pixel)
    middle = (low + high) / 2
    left, top = middle[0] - columns * mm_per_pixel / 2, middle[1] + rows * mm_per_pixel / 2
    x = left + (np.arange(columns) + 0.5) * mm_per_pixel
    y = top - (np.arange(rows) + 0.5) * mm_per_pixel

    z = np.full((rows, columns), np.nan)
    colors = None if solid.colors is None else np.tile(np.array(PLATE_COLOR), (rows, columns, 1))
    is_plate = np.ones((rows, columns), dtype=bool)
    scene, center, size = unit_box(solid.vertices, solid.faces)
    band = max(1, _RAYS_AT_ONCE // columns)
    for start in range(0, rows, band):
        here = slice(start, min(rows, start + band))
        face, weights = _first_hits(scene, center, size, x, y[here], float(high[2]))
        hit = face >= 0
        which, weight = face[hit], weights[hit]
        z[here][hit] = (solid.vertices[:, 2][solid.faces[which]] * weight).sum(axis=1)
        is_plate[here][hit] = solid.is_plate[which]
        if colors is not None and solid.colors is not None:
            own = np.einsum("hcj,hc->hj", solid.colors[solid.faces[which]], weight)
            colors[here][hit] = np.where(solid.is_plate[which, None], PLATE_COLOR, own)
    if np.isnan(z).all():
        raise ParameterError(f"mm_per_pixel must be smaller than the piece. Got {mm_per_pixel:g} instead.")
    return HeightField(
        z=z,
        colors=colors,
        is_plate=is_plate,
        mm_per_pixel=mm_per_pixel,
        left=float(left),
        top=float(top),
        back=float(low[2]),
        highest=float(high[2]),
    )


def _first_hits(
    scene: o3d.t.geometry.RaycastingScene,
    center: NDArray[np.float64],
    size: float,
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    above: float,
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return the face that each ray meets first (rows, columns), -1 for none, and the corners' weights."""
    rays = np.zeros((len(y), len(x), 6), dtype=np.float32)
    rays[..., 0] = (x - center[0]) / size
    rays[..., 1] = ((y - center[1]) / size)[:, None]
    rays[..., 2] = (above - center[2]) / size + 0.1
    rays[..., 5] = -1.0
    answer = scene.cast_rays(o3d.core.Tensor(rays))
    identity = answer["primitive_ids"].numpy()
    face = np.where(identity == scene.INVALID_ID, -1, identity.astype(np.int64))
    uv = np.clip(answer["primitive_uvs"].numpy().astype(np.float64), 0.0, 1.0)
    first = np.clip(1.0 - uv.sum(axis=-1, keepdims=True), 0.0, 1.0)
    return face, np.concatenate([first, uv], axis=-1)


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
        Too little memory for so many pixels.
    """
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
    a, b = number[:-1, :-1].ravel(), number[1:, :-1].ravel()
    c, d = number[1:, 1:].ravel(), number[:-1, 1:].ravel()
    along = (np.abs(z[a] - z[c]) <= np.abs(z[b] - z[d]))[:, None]  # the flatter diagonal follows an edge
    top = np.concatenate(
        [
            np.where(along, np.stack([a, b, c], 1), np.stack([a, b, d], 1)),
            np.where(along, np.stack([a, c, d], 1), np.stack([b, c, d], 1)),
        ]
    )
    # Counterclockwise seen from the front, as the top is.
    ring = np.concatenate([number[:-1, 0], number[-1, :-1], number[:0:-1, -1], number[0, :0:-1]])
    below = len(surface) + np.arange(len(ring))
    after, below_after = np.roll(ring, -1), np.roll(below, -1)
    center = np.full(len(ring), len(surface) + len(ring))
    sides = np.concatenate(
        [
            np.stack([ring, below, below_after], 1),
            np.stack([ring, below_after, after], 1),
            np.stack([below, center, below_after], 1),
        ]
    )
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
