"""Several pictures on one sheet: views of a relief beside its scene, and the stages of the method."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from o3d_relief.array_checks import check_picture
from o3d_relief.errors import FileError, ParameterError
from o3d_relief.param_checks import check_whole, told
from o3d_relief.records import StageRecord
from o3d_relief.show.annotate import font_size, write
from o3d_relief.show.camera import fit_scale, view_direction
from o3d_relief.show.easel import Easel
from o3d_relief.show.render import plate_bounds, render, save_png
from o3d_relief.show.scan_panels import SCAN_PANELS
from o3d_relief.show.stage_panels import PANELS

if TYPE_CHECKING:
    import open3d as o3d

__all__ = ["contact_sheet", "save_stage_pictures", "stage_picture", "view_sheet"]

_PAPER = (222, 222, 221)


def contact_sheet(
    images: Sequence[NDArray[np.uint8]],
    columns: int,
    *,
    titles: Sequence[str] = (),
    row_labels: Sequence[str] = (),
    gap: int = 8,
) -> NDArray[np.uint8]:
    """Put pictures of one size side by side, row after row.

    Parameters
    ----------
    images : sequence of (height, width, 3) uint8
    columns : int
        Pictures per row; the last row may be shorter.
    titles : sequence of str
        One above each picture, which may be empty, or none at all.
    row_labels : sequence of str
        One to the left of each row, or none at all.
    gap : int
        Pixels between the pictures.

    Returns
    -------
    (height, width, 3) uint8

    Raises
    ------
    ParameterError
        No pictures, pictures of different sizes, something else than pictures as `render` returns them and
        texts, or a wrong number of columns, titles or labels.

    Examples
    --------
    >>> contact_sheet([np.zeros((20, 30, 3), dtype=np.uint8)] * 3, 2, gap=0).shape
    (40, 60, 3)
    """
    for image in images:
        check_picture(image)
    if len({image.shape for image in images}) != 1:
        raise ParameterError("A sheet needs pictures, all of one size.")
    columns = check_whole("columns", columns)
    rows = -(-len(images) // columns)
    if len(titles) not in (0, len(images)) or len(row_labels) not in (0, rows):
        raise ParameterError("A sheet needs a title for each picture or none, a label for each row or none.")
    for text in (*titles, *row_labels):
        if not isinstance(text, str):
            raise ParameterError(f"Titles and labels must be text. Got {told(text)} instead.")
    height, width = images[0].shape[:2]
    letter = round(1.3 * font_size((width, height)))
    heads = [2 * letter if any(titles[row * columns : (row + 1) * columns]) else 0 for row in range(rows)]
    tops = [sum(heads[: row + 1]) + row * (height + gap) for row in range(rows)]
    side = round(max((0.6 * len(label) + 1.2) * letter for label in row_labels)) if row_labels else 0
    used = min(columns, len(images))
    shape = (tops[-1] + height, side + used * width + (used - 1) * gap, 3)
    sheet = np.full(shape, _PAPER, dtype=np.uint8)
    for number, image in enumerate(images):
        row, column = divmod(number, columns)
        top, left = tops[row], side + column * (width + gap)
        sheet[top : top + height, left : left + width] = image
        if titles and titles[number]:
            x, y = left + 0.5 * width, top - 0.5 * heads[row]
            sheet = write(sheet, titles[number], anchor="mm", x=x, y=y, pixels=letter)
    for row, label in enumerate(row_labels):
        y = tops[row] + 0.5 * height
        sheet = write(sheet, label, anchor="lm", x=0.6 * letter, y=y, pixels=letter)
    return sheet


def view_sheet(
    scene_mesh: o3d.geometry.TriangleMesh,
    relief_mesh: o3d.geometry.TriangleMesh,
    yaws: Sequence[float] = (0.0, 30.0, 60.0),
    *,
    panel: tuple[int, int] = (640, 720),
) -> NDArray[np.uint8]:
    """Show a scene above its relief, from the front and from the side, at one scale and under one light.

    Parameters
    ----------
    scene_mesh, relief_mesh : open3d.geometry.TriangleMesh
        Both in the relief frame and in one unit. The relief gets a plate at z = 0.
    yaws : sequence of float
        Degrees to the right of the front.
    panel : (width, height)
        Of each picture at most, in pixels; less high where the views are flat.

    Returns
    -------
    (height, width, 3) uint8

    Raises
    ------
    MeshError
        A mesh without a triangle to draw.
    """
    directions = [view_direction(yaw) for yaw in yaws]
    boxes = [_bounds(scene_mesh), _bounds(relief_mesh)]
    slab = plate_bounds(boxes[1])
    framed = [boxes[0], np.array([np.minimum(boxes[1][0], slab[0]), np.maximum(boxes[1][1], slab[1])])]
    views = [(box, direction) for box in framed for direction in directions]
    scale = min(fit_scale(box, direction, (0, 1, 0), panel) for box, direction in views)
    tallest = min(fit_scale(box, direction, (0, 1, 0), (np.inf, panel[1])) for box, direction in views)
    size = (panel[0], max(1, round(panel[1] * scale / tallest)))
    images = [
        render(mesh, direction=direction, size=size, plate=plate, bounds=box, scale=scale)
        for mesh, box, plate in ((scene_mesh, boxes[0], False), (relief_mesh, boxes[1], True))
        for direction in directions
    ]
    titles = [f"{yaw:g}°" for yaw in yaws] + [""] * len(directions)
    return contact_sheet(images, len(directions), titles=titles, row_labels=("scene", "relief"))


def _bounds(mesh: o3d.geometry.TriangleMesh) -> NDArray[np.float64]:
    return np.array([mesh.get_min_bound(), mesh.get_max_bound()])


def stage_picture(
    name: str,
    stages: Mapping[str, StageRecord],
    *,
    relief: o3d.geometry.TriangleMesh | None = None,
    size: tuple[int, int] = (1600, 800),
) -> NDArray[np.uint8]:
    """Show what a stage of the method did, in two panels.

    Parameters
    ----------
    name : str
        Of the stage.
    stages : mapping of str to StageRecord
        The records so far: the stage itself and those before it; later ones may be missing.
    relief : open3d.geometry.TriangleMesh, optional
        The finished relief, in the relief frame, for the stage "trim"; without it the last surface
        before the cut is drawn.
    size : (width, height)
        In pixels.

    Returns
    -------
    (height, width, 3) uint8

    Raises
    ------
    ParameterError
        An unknown stage, or a record that is missing.
    """
    panels = {**SCAN_PANELS, **PANELS}
    if name not in panels:
        raise ParameterError(f"name must be one of {', '.join(panels)}. Got {name!r} instead.")
    gap = 8
    easel = Easel(stages=stages, size=((size[0] - gap) // 2, size[1]), relief=relief)
    return contact_sheet(panels[name](easel), 2, gap=size[0] - 2 * easel.size[0])


def save_stage_pictures(
    stages: Mapping[str, StageRecord],
    directory: str | os.PathLike[str],
    *,
    relief: o3d.geometry.TriangleMesh | None = None,
    size: tuple[int, int] = (1600, 800),
    on_picture: Callable[[Path], None] | None = None,
) -> list[Path]:
    """Write a picture of each stage that has a record: 01_scene.png, 02_perspective.png, ...

    Where the scene was a point cloud, the stages of its meshing come first: 01_points.png, ...

    Parameters
    ----------
    stages : mapping of str to StageRecord
    directory : path
        An existing folder.
    relief : open3d.geometry.TriangleMesh, optional
        The finished relief, in the relief frame.
    size : (width, height)
        In pixels.
    on_picture : callable, optional
        Called with each file as soon as it is written.

    Returns
    -------
    list of Path
        The files, in the order of the stages.

    Raises
    ------
    FileError
        The folder is missing or cannot be written to.
    """
    folder = Path(directory)
    if not folder.is_dir():
        raise FileError(f"The folder {str(folder)!r} does not exist.")
    paths = []
    names = [*SCAN_PANELS, *PANELS] if SCAN_PANELS.keys() & stages.keys() else [*PANELS]
    # The bounded mode has a few stages only, the other has all but that one: each is counted by itself.
    names = [name for name in names if (name in stages if "bounded" in stages else name != "bounded")]
    for number, name in enumerate(names, start=1):
        if name in stages:
            paths.append(folder / f"{number:02d}_{name}.png")
            save_png(paths[-1], stage_picture(name, stages, relief=relief, size=size))
            if on_picture is not None:
                on_picture(paths[-1])
    return paths
