"""Surfaces as cameras see them: what is hit, at which height, with which normal."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from o3d_relief.rays import unit_box
from o3d_relief.scene.convert import arrays_mesh
from o3d_relief.show.camera import Camera, fit_camera, view_direction
from o3d_relief.show.render import render
from o3d_relief.show.similarity import Picture
from o3d_relief.stages.visibility import visible_vertices

__all__ = ["Body", "Shot", "discontinuities", "normal_angle", "overlap"]

_HALVINGS = 6
"""Times that the way between two pixels is halved to tell a jump from a steep slope."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Shot:
    """What an orthographic camera sees, in pixels (size, size).

    Attributes
    ----------
    hit : (size, size) bool
    height : (size, size) float64
        Towards the camera, from the point that it looks at; NaN where nothing is hit.
    normal : (size, size, 3) float32
        Of the triangle that is hit, turned to the camera, in the frame of the surface.
    face : (size, size) int64
        The triangle that is hit; -1 where there is none.
    """

    hit: NDArray[np.bool_]
    height: NDArray[np.float64]
    normal: NDArray[np.float32]
    face: NDArray[np.int64]


class Body:
    """A surface to take shots of.

    Parameters
    ----------
    vertices : (n, 3) float64
        In the relief frame.
    faces : (m, 3) int64
    middle : (2,) float64
        x and y of the point that cameras look at; its z is the middle of what is visible from the front.
    """

    def __init__(
        self, vertices: NDArray[np.float64], faces: NDArray[np.int64], middle: NDArray[np.float64]
    ) -> None:
        self.vertices, self.faces = vertices, faces
        self.visible = visible_vertices(vertices, faces)
        seen = vertices[self.visible, 2]
        self.depth = float(np.ptp(seen))
        self.target = np.array([middle[0], middle[1], (seen.min() + seen.max()) / 2])
        self._scene, self._box_middle, self._box_size = unit_box(vertices, faces)

    def camera(self, view: tuple[float, float], reach: NDArray[np.float64], size: int) -> Camera:
        """Return a camera that looks at the target and sees `reach` (3,) around it."""
        return fit_camera(
            np.array([self.target - reach, self.target + reach]),
            direction=view_direction(*view),
            up=(0.0, 1.0, 0.0),
            area=(0.0, 0.0, float(size), float(size)),
        )

    def shoot(self, view: tuple[float, float], reach: NDArray[np.float64], size: int) -> Shot:
        """Take a shot of size x size pixels, see `camera`."""
        camera = self.camera(view, reach, size)
        steps = np.arange(size) + 0.5
        x, y = np.meshgrid(steps, steps)
        height, normal, face = self.look(camera, np.column_stack([x.ravel(), y.ravel()]))
        return Shot(
            hit=np.isfinite(height).reshape(size, size),
            height=height.reshape(size, size),
            normal=normal.reshape(size, size, 3),
            face=face.reshape(size, size),
        )

    def picture(self, view: tuple[float, float], reach: NDArray[np.float64], size: int) -> Picture:
        """Take a picture of size x size pixels in the studio's light, with cast shadows, see `camera`."""
        drawn = render(
            arrays_mesh(self.vertices, self.faces),
            direction=view_direction(*view),
            bounds=np.array([self.target - reach, self.target + reach]),
            size=(size, size),
            supersampling=1,
        )
        return Picture(pixels=drawn.mean(axis=2), covered=self.shoot(view, reach, size).hit)

    def look(
        self, camera: Camera, places: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float32], NDArray[np.int64]]:
        """Return the heights (p,), normals (p, 3) and faces (p,) at places (p, 2) of a picture, in pixels."""
        right, upward, back = camera.axes
        across = (places[:, 0] - camera.middle[0]) / camera.scale
        above = (camera.middle[1] - places[:, 1]) / camera.scale
        start = float(np.linalg.norm(self.vertices - camera.center, axis=1).max()) * 1.01
        origins = camera.center + across[:, None] * right + above[:, None] * upward + start * back
        rays = np.empty((len(places), 6), dtype=np.float32)
        rays[:, :3] = (origins - self._box_middle) / self._box_size
        rays[:, 3:] = -back
        hits = self._scene.cast_rays(o3d.core.Tensor(rays))
        distance = hits["t_hit"].numpy().astype(np.float64)
        normal = hits["primitive_normals"].numpy()
        normal = normal * np.where(normal @ back.astype(np.float32) < 0.0, -1.0, 1.0)[:, None]
        height = np.where(np.isfinite(distance), start - distance * self._box_size, np.nan)
        face = np.where(np.isfinite(distance), hits["primitive_ids"].numpy().astype(np.int64), -1)
        return height, normal.astype(np.float32), face


def normal_angle(one: Shot, other: Shot) -> float:
    """Return the mean angle between the normals over the pixels that both cover, in degrees.

    NaN where they share none.
    """
    both = one.hit & other.hit
    if not both.any():
        return float("nan")
    a, b = one.normal[both].astype(np.float64), other.normal[both].astype(np.float64)
    # Half-angle form: the arc cosine loses small angles.
    apart, together = np.linalg.norm(a - b, axis=1), np.linalg.norm(a + b, axis=1)
    return float(np.degrees(2.0 * np.arctan2(apart, together)).mean())


def overlap(one: Shot, other: Shot) -> float:
    """Return the pixels that both cover over the pixels that either covers."""
    return float((one.hit & other.hit).sum() / (one.hit | other.hit).sum())


def discontinuities(
    body: Body, camera: Camera, shot: Shot, jump: float
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Find the neighbouring pixels of a shot between which the depth jumps.

    A steep slope is no jump: the picture is looked at again in the middle between the two pixels, and again
    in the half where more of the difference remains. What is continuous differs less and less.

    Parameters
    ----------
    body : Body
    camera : Camera
        That of the shot.
    shot : Shot
    jump : float
        Smallest difference of height that counts.

    Returns
    -------
    high, low : (p,) int64
        The pixel on either side, as index into the flattened shot.
    """
    number = np.arange(shot.hit.size).reshape(shot.hit.shape)
    ends = [(number[:, :-1], number[:, 1:]), (number[:-1], number[1:])]
    one = np.concatenate([first.ravel() for first, _ in ends])
    other = np.concatenate([second.ravel() for _, second in ends])
    height = shot.height.ravel()
    swap = height[other] > height[one]
    high, low = np.where(swap, other, one), np.where(swap, one, other)
    # A difference with NaN, where one of them misses, is not greater than anything.
    wide = height[high] - height[low] >= jump
    high, low = high[wide], low[wide]
    width = shot.hit.shape[1]
    top, top_place = height[high], np.column_stack([high % width, high // width]) + 0.5
    bottom, bottom_place = height[low], np.column_stack([low % width, low // width]) + 0.5
    for _ in range(_HALVINGS):
        place = (top_place + bottom_place) / 2
        between, _, _ = body.look(camera, place)
        up = top - between < between - bottom  # the jump is below: the upper end moves
        top, top_place = np.where(up, between, top), np.where(up[:, None], place, top_place)
        bottom, bottom_place = np.where(up, bottom, between), np.where(up[:, None], bottom_place, place)
    real = top - bottom >= jump  # not so where a hole lies between
    return high[real], low[real]
