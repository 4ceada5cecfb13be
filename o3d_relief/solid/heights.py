"""The upper envelope of a solid, seen from the front."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from o3d_relief.errors import ParameterError
from o3d_relief.frozen import Frozen
from o3d_relief.limits import check_field
from o3d_relief.param_checks import check_kind, check_positive
from o3d_relief.rays import unit_box
from o3d_relief.solid.body import PLATE_COLOR, Solid

__all__ = ["HeightField", "check_pixels", "height_field"]

_RAYS_AT_ONCE = 2_000_000
_BESIDE = ((1e-6, 1e-6), (-1e-6, 1e-6), (-1e-6, -1e-6), (1e-6, -1e-6))
"""Where a ray that has slipped through is cast again, as shares of the solid's size."""


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class HeightField(Frozen):
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
        Pixels that are not greater than 0, so small that there are more than 40 million, or larger than the
        piece; something else than a solid.

    Examples
    --------
    >>> from o3d_relief.solid.body import manifold_of
    >>> v = np.array([[0, 0, 0], [3, 0, 0], [0, 3, 0], [0, 0, 3.0]])
    >>> f = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    >>> corner = Solid.from_manifold(manifold_of(v, f, is_plate=False), colored=False)
    >>> height_field(corner, 1.0).z[2, :2].round(6).tolist()
    [2.0, 1.0]
    """
    check_kind("solid", solid, Solid, "make_solid")
    mm_per_pixel = check_positive("mm_per_pixel", mm_per_pixel)
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
    """Return the face that each ray meets first (rows, columns), -1 for none, and the corners' weights.

    A ray right at a vertex may slip between the faces there. It then meets a face from inside the solid, and
    is cast again a hair beside.
    """
    rays = np.zeros((len(y), len(x), 6), dtype=np.float32)
    rays[..., 0] = (x - center[0]) / size
    rays[..., 1] = ((y - center[1]) / size)[:, None]
    rays[..., 2] = (above - center[2]) / size + 0.1
    rays[..., 5] = -1.0
    face, weights, slipped = _cast(scene, rays)
    for sideways in _BESIDE:
        if not slipped.any():
            break
        again = rays[slipped]
        again[:, :2] += np.array(sideways, dtype=np.float32)
        found, shares, inside = _cast(scene, again)
        good = (found >= 0) & ~inside
        mended = tuple(axis[good] for axis in np.nonzero(slipped))
        face[mended], weights[mended], slipped[mended] = found[good], shares[good], False
    return face, weights


def _cast(
    scene: o3d.t.geometry.RaycastingScene, rays: NDArray[np.float32]
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.bool_]]:
    """Return the face that each ray meets first, the weights of its corners, and whether from inside."""
    answer = scene.cast_rays(o3d.core.Tensor(rays))
    identity = answer["primitive_ids"].numpy()
    face = np.where(identity == scene.INVALID_ID, -1, identity.astype(np.int64))
    uv = np.clip(answer["primitive_uvs"].numpy().astype(np.float64), 0.0, 1.0)
    first = np.clip(1.0 - uv.sum(axis=-1, keepdims=True), 0.0, 1.0)
    inside = (face >= 0) & (answer["primitive_normals"].numpy()[..., 2] < 0.0)
    return face, np.concatenate([first, uv], axis=-1), inside
