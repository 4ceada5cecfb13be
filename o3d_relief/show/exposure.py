"""One exposure: what the rays of a picture see, and how bright it is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from o3d_relief.show.light import (
    cast_rays,
    lamp_directions,
    occluded,
    sky_directions,
    smooth_over_tile,
    tile_index,
)
from o3d_relief.show.paint import Paint
from o3d_relief.show.surface import Surface

if TYPE_CHECKING:
    import open3d as o3d

__all__ = ["Exposure", "Lighting"]

Floats = NDArray[np.float32]

_HALO = 8  # rows of neighbours that a band needs for its filters
_SKY_BITS, _SKY_RAYS = 3, 2  # 8 x 8 points share 128 directions
_SKY_REACH = 0.5  # of the scene's extent
_LAMP_BITS, _LAMP_RAYS = 2, 2  # 4 x 4 points share 32 points of the lamp
_LAMP_RADIUS = 1.8  # degrees
_CREVICE = 0.25  # share of the lamp's light that fine hollows lose as they lose the sky's
_LIFT = 1e-4  # of the scene's extent: where secondary rays start


@dataclass(frozen=True, kw_only=True, eq=False)
class Lighting:
    """The lamp and what is asked of it.

    Attributes
    ----------
    direction : (3,) float64
        Unit vector to the lamp, in the frame of the surface.
    shadows, ambient_occlusion : bool
    """

    direction: NDArray[np.float64]
    shadows: bool = True
    ambient_occlusion: bool = True


@dataclass(frozen=True, kw_only=True, eq=False)
class Exposure:
    """What stays the same over a picture. Lengths in units of the scene's extent.

    Attributes
    ----------
    scene : RaycastingScene
    surface : Surface
    tangents : (m, 3) float32
        Of each corner of each face, recentred and scaled to the unit box: its share along its normal, which
        is where its tangent plane lies.
    paint : Paint
    lighting : Lighting
    axes : (3, 3) float32
        Right, up, towards the camera.
    corner : (3,) float64
        Upper left corner of the picture, in front of everything.
    step : float
        Distance of neighbouring rays.
    size : (width, height)
        In rays.
    """

    scene: o3d.t.geometry.RaycastingScene
    surface: Surface
    tangents: Floats
    paint: Paint
    lighting: Lighting
    axes: Floats
    corner: NDArray[np.float64]
    step: float
    size: tuple[int, int]

    def band(self, first: int, last: int) -> tuple[Floats, NDArray[np.bool_]]:
        """Return the linear colours (rows, width, 3) of a band of rows, and what was hit (rows, width)."""
        top, bottom = max(0, first - _HALO), min(self.size[1], last + _HALO)
        rows, columns = np.arange(top, bottom), np.arange(self.size[0])
        shape = (len(rows), len(columns))
        axes = self.axes.astype(np.float64)
        left = self.corner + (columns[:, None] + 0.5) * self.step * axes[0]
        down = (rows[:, None] + 0.5) * self.step * axes[1]
        origins = (left[None, :] - down[:, None]).astype(np.float32).reshape(-1, 3)
        hit, face, weights, distance = cast_rays(self.scene, origins, -self.axes[2])
        color = np.zeros((len(origins), 3), dtype=np.float32)
        if np.any(hit):
            place = origins[hit] - distance[:, None] * self.axes[2]
            seen = _Seen(self, hit.reshape(shape), top, face, weights, place, distance)
            color[hit] = seen.color()
        inner = slice(first - top, last - top)
        return color.reshape(*shape, 3)[inner], hit.reshape(shape)[inner]


class _Seen:
    """The points that a band of rays hits: h points, one a hit, in the order of the rays."""

    def __init__(
        self,
        exposure: Exposure,
        hit: NDArray[np.bool_],
        top: int,
        face: NDArray[np.int64],
        weights: Floats,
        place: Floats,
        distance: Floats,
    ) -> None:
        self.exposure, self.hit, self.top = exposure, hit, top
        self.face, self.weights, self.place, self.distance = face, weights, place, distance
        axes, surface = exposure.axes, exposure.surface
        flat = surface.normals[face]
        turned = flat @ axes[2] < 0.0
        self.behind = turned & ~surface.doubled[face]
        self.sign = np.where(turned, np.float32(-1.0), np.float32(1.0))[:, None]
        self.flat = flat * self.sign
        blended = np.einsum("hcj,hc->hj", surface.corner_normals[face], weights * self.sign)
        self.normal = _towards(blended, axes[2])
        self.camera_normal = np.zeros((*hit.shape, 3), dtype=np.float32)
        self.camera_normal[hit] = self.flat @ axes.T

    def color(self) -> Floats:
        """Return the linear colours (h, 3)."""
        lighting = self.exposure.lighting
        lamp = np.maximum(self.normal @ lighting.direction.astype(np.float32), np.float32(0.0))
        if lighting.shadows:
            facing = lamp > 0.0
            lamp = lamp * self._smooth(self._lamp_seen(facing), facing, _LAMP_BITS)
        sky = np.ones(len(self.face), dtype=np.float32)
        if lighting.ambient_occlusion:
            sky = self._smooth(self._sky_seen(), np.ones(len(sky), dtype=bool), _SKY_BITS)
            lamp = lamp * (np.float32(1.0 - _CREVICE) + np.float32(_CREVICE) * sky)
        albedo = self.exposure.paint.albedo(self.exposure.surface, self.face, self.weights)
        light = self._light(lamp, sky)
        light[self.behind] *= np.float32(0.45)
        return np.asarray(albedo * light)

    def _smooth(self, value: Floats, among: NDArray[np.bool_], bits: int) -> Floats:
        """Average the values (h,) of the points `among` (h,) over their tiles."""
        grid = np.zeros(self.hit.shape, dtype=np.float32)
        depth = np.full(self.hit.shape, np.nan, dtype=np.float32)
        grid[self.hit] = value
        depth[self.hit] = np.where(among, -self.distance, np.float32(np.nan))
        return smooth_over_tile(grid, depth, self.camera_normal, self.exposure.step, 1 << bits)[self.hit]

    def _tile(self, bits: int) -> NDArray[np.int64]:
        """Return each point's number in its tile (h,)."""
        rows = np.arange(self.top, self.top + self.hit.shape[0])
        return tile_index(rows[:, None], np.arange(self.hit.shape[1]), bits)[self.hit]

    def _lamp_seen(self, wanted: NDArray[np.bool_]) -> Floats:
        exposure = self.exposure
        lamp = lamp_directions(exposure.lighting.direction, _LAMP_RADIUS, 4**_LAMP_BITS * _LAMP_RAYS)
        tile = self._tile(_LAMP_BITS)[wanted]
        start = self._on_smooth_surface(wanted) + _LIFT * self.normal[wanted]
        seen = np.zeros(len(wanted), dtype=np.float32)
        for number in range(_LAMP_RAYS):
            seen[wanted] += ~occluded(exposure.scene, start, lamp[tile + number * 4**_LAMP_BITS])
        return np.asarray(seen / np.float32(_LAMP_RAYS))

    def _on_smooth_surface(self, wanted: NDArray[np.bool_]) -> Floats:
        """Lift points from their triangle to the curved surface that its corner normals suggest.

        Shadow rays from there do not show the facets where the light grazes: each point is moved out to
        the tangent planes of the corners, weighted by their nearness.
        """
        place, face, sign = self.place[wanted], self.face[wanted], self.sign[wanted]
        normals = self.exposure.surface.corner_normals[face]
        above = (np.einsum("hj,hcj->hc", place, normals) - self.exposure.tangents[face]) * sign
        lift = np.minimum(above, 0.0) * self.weights[wanted] * -sign
        return np.asarray(place + np.einsum("hc,hcj->hj", lift, normals))

    def _sky_seen(self) -> Floats:
        sphere, reach = sky_directions(4**_SKY_BITS * _SKY_RAYS, _SKY_REACH)
        tile = self._tile(_SKY_BITS) * _SKY_RAYS
        start = self.place + _LIFT * self.flat
        seen = np.zeros(len(tile), dtype=np.float32)
        for number in range(_SKY_RAYS):
            directions = self.normal + sphere[tile + number]
            below = np.minimum(np.einsum("hj,hj->h", directions, self.flat), 0.0)
            directions = _unit(directions - 2.0 * below[:, None] * self.flat) * reach[tile + number, None]
            seen += ~occluded(self.exposure.scene, start, directions, length=1.0)
        return np.asarray(seen / np.float32(_SKY_RAYS))

    def _light(self, lamp: Floats, sky: Floats) -> Floats:
        """Sum up the lamp (warm), the sky (cool, brighter from above) and a weak light at the camera."""
        upward = np.float32(0.5) + np.float32(0.5) * (self.normal @ self.exposure.axes[1])
        facing = self.normal @ self.exposure.axes[2]
        ambient = sky * (np.float32(0.12) + np.float32(0.12) * upward + np.float32(0.08) * facing)
        warm = np.array([1.0, 0.96, 0.90], dtype=np.float32) * np.float32(1.0)
        cool = np.array([0.94, 0.97, 1.0], dtype=np.float32)
        return np.asarray(lamp[:, None] * warm + ambient[:, None] * cool)


def _unit(vectors: Floats) -> Floats:
    length = np.sqrt(np.einsum("hj,hj->h", vectors, vectors))
    return np.asarray(vectors / np.maximum(length, 1e-12)[:, None], dtype=np.float32)


def _towards(normal: Floats, back: Floats) -> Floats:
    """Make normals unit vectors that do not point away from the camera."""
    normal = _unit(normal)
    away = np.minimum(normal @ back, 0.0)
    return _unit(normal - away[:, None] * back)
