"""From a surface and a camera to the finished pixels: the picture in bands, on several threads."""

from __future__ import annotations

import os
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from o3d_relief.show.camera import Camera, box_corners
from o3d_relief.show.colors import to_linear, to_srgb
from o3d_relief.show.exposure import Exposure, Lighting
from o3d_relief.show.paint import Paint
from o3d_relief.show.surface import Surface

__all__ = ["take_picture"]

Floats = NDArray[np.float32]


def take_picture(
    surface: Surface,
    camera: Camera,
    size: tuple[int, int],
    *,
    paint: Paint,
    lighting: Lighting,
    slab: NDArray[np.float64] | None,
    background: NDArray[np.float64],
    supersampling: int,
) -> NDArray[np.uint8]:
    """Take a picture.

    Parameters
    ----------
    surface : Surface
    camera : Camera
        Orthographic, in the frame of the surface.
    size : (width, height)
        In pixels.
    paint : Paint
    lighting : Lighting
    slab : (2, 3) float64 or None
        A plate, least and greatest corner.
    background : (3,) float64
        sRGB.
    supersampling : int
        Rays per pixel along x and along y.

    Returns
    -------
    (height, width, 3) uint8
    """
    if slab is not None:
        paint = replace(paint, plate_from=len(surface.faces))
        surface = surface.joined_with_box(slab)
    left, top, right, bottom = _window(surface, camera, size)
    setup = _prepare(surface, camera, (left, top, right, bottom), paint, lighting, supersampling)
    backdrop = to_linear(background)
    image = np.tile(_pixels(backdrop), (size[1], size[0], 1))

    def develop(rows: tuple[int, int]) -> None:
        color, hit = setup.band((rows[0] - top) * supersampling, (rows[1] - top) * supersampling)
        color = _average(_shoulder(color), supersampling)
        cover = _average(hit.astype(np.float32), supersampling)[..., None]
        image[rows[0] : rows[1], left:right] = _pixels(color + (1.0 - cover) * backdrop)

    if left < right:
        with ThreadPoolExecutor(max_workers=min(4, os.cpu_count() or 1)) as pool:
            for _ in pool.map(develop, _bands(top, bottom, (right - left) * supersampling**2)):
                pass
    return image


def _window(surface: Surface, camera: Camera, size: tuple[int, int]) -> tuple[int, int, int, int]:
    """Return the part of the picture that the surface can fill: left, top, right, bottom in pixels.

    It starts at a multiple of 8, so that the pattern of the rays does not depend on the surface.
    """
    spots = camera.project(box_corners(surface.bounds()))[:, :2]
    low = np.floor(np.clip(spots.min(axis=0) - 2.0, 0.0, size) / 8.0).astype(int) * 8
    high = np.ceil(np.clip(spots.max(axis=0) + 2.0, 0.0, size)).astype(int)
    if np.any(high <= low):
        return 0, 0, 0, 0
    return int(low[0]), int(low[1]), int(high[0]), int(high[1])


def _bands(top: int, bottom: int, rays_per_row: int) -> Iterator[tuple[int, int]]:
    """Cut the rows into bands of about 200 000 rays, which bounds the memory."""
    rows = max(8, 200_000 // rays_per_row)
    for first in range(top, bottom, rows):
        yield first, min(first + rows, bottom)


def _prepare(
    surface: Surface,
    camera: Camera,
    window: tuple[int, int, int, int],
    paint: Paint,
    lighting: Lighting,
    supersampling: int,
) -> Exposure:
    import open3d as o3d

    low, high = surface.bounds()
    extent = float(np.max(high - low))
    middle = 0.5 * (low + high)
    vertices = ((surface.vertices - middle) / extent).astype(np.float32)
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(
        o3d.core.Tensor.from_numpy(vertices), o3d.core.Tensor.from_numpy(surface.faces.astype(np.uint32))
    )
    right, upward, back = camera.axes
    center = (camera.center - middle) / extent
    pixel = 1.0 / (camera.scale * extent)
    across, down = camera.middle[0] - window[0], camera.middle[1] - window[1]
    corner = center - (center @ back) * back + back - pixel * (across * right - down * upward)
    return Exposure(
        scene=scene,
        surface=surface,
        tangents=np.einsum("fcj,fcj->fc", vertices[surface.faces], surface.corner_normals),
        paint=paint,
        lighting=lighting,
        axes=camera.axes.astype(np.float32),
        corner=corner,
        step=pixel / supersampling,
        size=((window[2] - window[0]) * supersampling, (window[3] - window[1]) * supersampling),
    )


def _average(values: Floats, width: int) -> Floats:
    """Average over squares of width x width."""
    parts = [values[row::width, column::width] for row in range(width) for column in range(width)]
    return np.asarray(sum(parts[1:], start=parts[0]) / np.float32(len(parts)))


def _pixels(linear: Floats) -> NDArray[np.uint8]:
    return np.asarray(np.rint(to_srgb(linear) * 255.0), dtype=np.uint8)


def _shoulder(color: Floats) -> Floats:
    """Let bright light run softly into white; what is below 0.7 stays as it is."""
    over = np.maximum(color - np.float32(0.7), np.float32(0.0))
    dark = np.minimum(color, np.float32(0.7))
    return np.asarray(dark + np.float32(0.3) * (1.0 - np.exp(-over / np.float32(0.3))))
