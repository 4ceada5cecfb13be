"""Pictures of a mesh without a display: rays by Open3D, the rest numpy and Pillow."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image

from o3d_relief.array_checks import (
    as_numbers,
    check_array,
    check_colors,
    check_ends,
    check_picture,
    check_size,
)
from o3d_relief.errors import ParameterError
from o3d_relief.files import write_bytes
from o3d_relief.param_checks import check_positive, check_range, check_whole
from o3d_relief.show.annotate import Bar, annotate, draw_points, free_area
from o3d_relief.show.camera import fit_camera, unit_vector, view_direction
from o3d_relief.show.colors import COLORMAPS, apply_colormap, finite_range, to_linear
from o3d_relief.show.darkroom import take_picture
from o3d_relief.show.exposure import Lighting
from o3d_relief.show.paint import Paint
from o3d_relief.show.surface import Surface, read_surface

if TYPE_CHECKING:
    import open3d as o3d

__all__ = ["plate_bounds", "render", "save_png", "view_direction"]


def render(
    mesh: o3d.geometry.TriangleMesh,
    *,
    direction: ArrayLike = (0.0, 0.0, 1.0),
    up: ArrayLike = (0.0, 1.0, 0.0),
    size: tuple[int, int] = (800, 800),
    light: ArrayLike = (-0.55, 0.65, 0.6),
    ambient_occlusion: bool = True,
    shadows: bool = True,
    crease: float = 50.0,
    colors: ArrayLike | None = None,
    sharp_colors: bool = False,
    field: ArrayLike | None = None,
    field_range: tuple[float, float] | None = None,
    field_label: str = "",
    colormap: str = "viridis",
    points: ArrayLike | None = None,
    point_colors: ArrayLike | None = None,
    point_field: ArrayLike | None = None,
    point_radius: float = 4.0,
    legend: Sequence[tuple[ArrayLike, str]] = (),
    title: str = "",
    plate: bool = False,
    bounds: ArrayLike | None = None,
    scale: float | None = None,
    background: ArrayLike = (0.87, 0.87, 0.865),
    supersampling: int = 2,
) -> NDArray[np.uint8]:
    """Draw a mesh as a photographer would show a piece of sculpture.

    One lamp with soft shadows, a weak fill from the camera, and the light of the sky with ambient
    occlusion. Surfaces seen from behind (the inside of an open mesh) are drawn darker, unless the mesh as a
    whole is inside out or the face is there twice. Equal input gives equal bytes, whatever the number of
    threads.

    Parameters
    ----------
    mesh : open3d.geometry.TriangleMesh
        n vertices. Needs no normals, may have degenerate triangles; vertex colours and textures are
        drawn. Never modified.
    direction, up : (3,) float
        Direction from the mesh to the camera, and the one that points up in the picture.
    size : (width, height)
        In pixels.
    light : (3,) float
        Direction from the mesh to the lamp, in the frame of the mesh: views of a relief from different
        sides show it under the same light.
    ambient_occlusion, shadows : bool
    crease : float
        Degrees. Edges sharper than this stay sharp, all others are smooth; 0 gives flat shading.
    colors : (n, 3) float, optional
        sRGB colours in [0, 1] instead of the mesh's own; those of vertices that no face uses do not count.
    sharp_colors : bool
        Do not blend colours between vertices: right for labels.
    field : (n,) float, optional
        Numbers shown as colours instead of the mesh's own; grey where not finite.
    field_range : (low, high), optional
        What the ends of the colour map stand for. None: the least and the greatest number.
    field_label : str
        Caption of the colour bar.
    colormap : str
        "viridis", "diverging" or "heat".
    points : (p, 3) float, optional
        Points drawn on top, also where the mesh hides them, in the frame of the mesh; those that are not
        finite are left out.
    point_colors : (3,) or (p, 3) float, optional
        sRGB in [0, 1].
    point_field : (p,) float, optional
        Numbers shown as colours of the points, with the colour map, range and caption of `field`.
    point_radius : float
        In pixels.
    legend : sequence of (colour, text)
    title : str
    plate : bool
        Put a flat plate behind the mesh, its face at z = 0, a little larger than the bounds.
    bounds : (2, 3) float, optional
        The box that fills the picture, least and greatest corner; None: that of the mesh. Pictures
        with equal bounds, directions and sizes have the same framing.
    scale : float, optional
        Pixels per unit of length, instead of filling the picture.
    background : (3,) float
        sRGB in [0, 1].
    supersampling : int
        Rays per pixel along x and along y.

    Returns
    -------
    (height, width, 3) uint8

    Raises
    ------
    MeshError
        No triangle to draw, a vertex that is not finite or a face index out of range.
    ParameterError
        An argument of the wrong shape or out of range.

    Examples
    --------
    >>> import open3d as o3d
    >>> image = render(o3d.geometry.TriangleMesh.create_sphere(), size=(64, 48), supersampling=1)
    >>> image.shape, bool(image[15, 25].sum() > image[32, 38].sum())  # the lamp is at the upper left
    ((48, 64, 3), True)
    """
    size, supersampling = check_size(size), check_whole("supersampling", supersampling, 1, 8)
    crease = check_range("crease", crease, 0.0)
    scale = None if scale is None else check_positive("scale", scale)
    point_radius = check_range("point_radius", point_radius, 0.0)
    if colormap not in COLORMAPS:
        raise ParameterError(f"colormap must be one of {', '.join(COLORMAPS)}. Got {colormap!r} instead.")
    surface = read_surface(mesh, crease)
    if sum(choice is not None for choice in (colors, field, point_field)) > 1:
        raise ParameterError("colors, field and point_field exclude each other: give one of them.")
    shown = None if field_range is None else check_ends("field_range", field_range)
    for name, values in (("field", field), ("point_field", point_field)):
        if values is not None and shown is None:
            shown = finite_range(as_numbers(name, values))
    bar = None if shown is None or (field is None and point_field is None) else (colormap, shown, field_label)
    paint = _paint(surface, colors, sharp_colors, field, bar)
    box = surface.bounds() if bounds is None else check_array("bounds", bounds, (2, 3))
    area = free_area(size, title=title, legend=legend, bar=bar)
    slab = plate_bounds(box) if plate else None
    framed = box if slab is None else np.array([np.minimum(box[0], slab[0]), np.maximum(box[1], slab[1])])
    camera = fit_camera(framed, direction=direction, up=up, area=area, scale=scale)
    image = take_picture(
        surface,
        camera,
        size,
        paint=paint,
        lighting=Lighting(
            direction=unit_vector("light", light), shadows=shadows, ambient_occlusion=ambient_occlusion
        ),
        slab=slab,
        background=check_colors("background", background, (3,)),
        supersampling=supersampling,
    )
    if points is not None:
        places = _check_points(points)
        shades = _point_colors(len(places), point_colors, point_field, bar)
        known = np.isfinite(places).all(axis=1)
        image = draw_points(image, camera.project(places[known]), shades[known], point_radius)
    return annotate(image, title=title, legend=legend, bar=bar)


def plate_bounds(bounds: ArrayLike) -> NDArray[np.float64]:
    """Return the box (2, 3) of the plate that `render` puts behind what lies in `bounds`.

    Its face lies at z = 0 (a hair behind, so that it does not flicker through flat parts at z = 0), it is
    7 % wider on each side and 3 % thick.

    Examples
    --------
    >>> plate_bounds([(0, 0, 0), (100, 50, 10)])[1].round(6).tolist()
    [107.0, 57.0, -0.02]
    """
    low, high = np.asarray(bounds, dtype=np.float64)
    width = max(float(np.max((high - low)[:2])), 1e-300)
    margin = 0.07 * width
    return np.array(
        [
            [low[0] - margin, low[1] - margin, -0.03 * width],
            [high[0] + margin, high[1] + margin, -2e-4 * width],
        ]
    )


def save_png(path: str | Path, image: NDArray[np.uint8]) -> None:
    """Write a picture as PNG; the file appears only when it is complete.

    Parameters
    ----------
    path : path
    image : (height, width, 3) uint8

    Raises
    ------
    FileError
        The folder is missing or cannot be written to.
    ParameterError
        Something else than a picture, or one without a pixel.
    """
    check_picture(image)
    content = BytesIO()
    Image.fromarray(image).save(content, format="PNG")
    write_bytes(path, content.getvalue())


def _check_points(points: ArrayLike) -> NDArray[np.float64]:
    array = as_numbers("points", points)
    if array.ndim != 2 or array.shape[1] != 3:
        raise ParameterError(f"points must have the shape (p, 3). Got {array.shape} instead.")
    return array


def _point_colors(
    count: int, colors: ArrayLike | None, field: ArrayLike | None, bar: Bar | None
) -> NDArray[np.float64]:
    if field is not None and bar is not None:
        return apply_colormap(check_array("point_field", field, (count,)), bar[0], bar[1])
    array = as_numbers("point_colors", (0.85, 0.2, 0.15) if colors is None else colors)
    every = np.tile(array, (count, 1)) if array.shape == (3,) else array
    return check_colors("point_colors", every, (count, 3))


def _paint(
    surface: Surface, colors: ArrayLike | None, sharp: bool, field: ArrayLike | None, bar: Bar | None
) -> Paint:
    count = len(surface.vertices)
    if colors is not None:
        shades = np.zeros((count, 3))
        used = np.unique(surface.faces)  # those of other vertices may be anything
        shades[used] = check_colors("colors", check_array("colors", colors, (count, 3))[used], (len(used), 3))
        return Paint(colors=to_linear(shades), sharp=sharp)
    if field is None or bar is None:
        return Paint(sharp=sharp)
    return Paint(
        field=check_array("field", field, (count,)), colormap=bar[0], field_range=bar[1], sharp=sharp
    )
