"""The command's way from a relief to a checked solid."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from o3d_relief.limits import field_memory
from o3d_relief.params import ReliefParams, View
from o3d_relief.plate_params import PlateParams
from o3d_relief.progress import OnProgress, Progress
from o3d_relief.relief import Relief
from o3d_relief.solid.body import Solid
from o3d_relief.solid.checks import SolidReport, check_solid
from o3d_relief.solid.estimate import estimate_relief, estimate_solid, front_size
from o3d_relief.solid.heights import check_pixels
from o3d_relief.solid.make import make_solid
from o3d_relief.solid.measures import wall_thickness
from o3d_relief.workshop import Work, work_on
from o3d_relief.workshop_params import MillParams, TileParams

__all__ = ["Made", "check_mill", "make_checked", "tell_estimate", "wall_picture"]

Tell = Callable[[str], None]


@dataclass(frozen=True, kw_only=True, eq=False)
class Made:
    """A solid, how it was asked for and what was measured on it."""

    solid: Solid
    plate: PlateParams
    report: SolidReport
    work: Work

    def values(self) -> dict[str, Any]:
        """Return what the report file says of the solid."""
        return {"plate": asdict(self.plate), "solid": self.report.values(), **self.work.report()}

    def draw_walls(self, path: Path) -> None:
        """Write a picture of the wall thickness, see `wall_picture`."""
        from o3d_relief.show.render import save_png

        save_png(path, wall_picture(self.solid, self.plate))


def make_checked(
    relief: Relief,
    plate: PlateParams,
    tell: Tell,
    *,
    mill: MillParams | None = None,
    undercut_free: bool = False,
    tiles: TileParams | None = None,
    on_progress: OnProgress | None = None,
) -> Made:
    """Make a solid, mill and cut it as far as asked for, check it and tell what comes out.

    Parameters
    ----------
    relief : Relief
    plate : PlateParams
    tell : callable
        Takes a line.
    mill, undercut_free, tiles
        See `work_on`.
    on_progress : callable, optional
        Called with "solid", "work" and "checks"; see `make_solid`.

    Returns
    -------
    Made
    """
    progress = Progress(on_progress)
    solid = make_solid(relief, plate, on_progress=on_progress)
    progress.begin("work")
    work = work_on(solid, mill=mill, undercut_free=undercut_free, tiles=tiles)
    progress.end()
    solid = work.solid
    progress.begin("checks")
    report = check_solid(solid, plate)
    progress.end()
    x, y, z = report.size_mm
    tell(
        f"solid: {x:.2f} x {y:.2f} x {z:.2f} mm, {report.volume_mm3 / 1000.0:.1f} cm3, {report.triangles} "
        f"triangles; print checks: {report.verdict}"
    )
    for sentence in (*report.failures, *report.warnings, *work.sentences()):
        tell(f"  {sentence}")
    return Made(solid=solid, plate=plate, report=report, work=work)


def check_mill(
    mesh: o3d.geometry.TriangleMesh,
    view: View,
    plate: PlateParams,
    mill: MillParams,
    *,
    undercut_free: bool,
    max_triangles: int | None = None,
) -> None:
    """Refuse a height field of too many pixels before the relief is made.

    Parameters
    ----------
    mesh : open3d.geometry.TriangleMesh
    view : View
    plate : PlateParams
    mill : MillParams
        Of the height field that is taken of the solid.
    undercut_free : bool
        Whether the solid becomes that height field.
    max_triangles : int, optional
        As in `make_relief`.

    Raises
    ------
    MeshError
        A mesh from which no relief, or no solid, can be made.
    ParameterError
        More pixels than a height field may have, or than there is memory for.
    """
    size = front_size(mesh, view, plate, max_triangles=max_triangles)
    check_pixels(*size, mill.mm_per_pixel, about=True, solid=undercut_free)


def tell_estimate(
    mesh: o3d.geometry.TriangleMesh,
    params: ReliefParams,
    view: View,
    plate: PlateParams | None,
    tell: Tell,
    *,
    mill: MillParams | None = None,
    undercut_free: bool = False,
    max_triangles: int | None = None,
) -> None:
    """Tell what a solid, or a relief alone, will measure.

    Parameters
    ----------
    mesh : open3d.geometry.TriangleMesh
    params : ReliefParams
    view : View
    plate : PlateParams or None
        None where only a relief is wanted, which has no volume and is told in the unit of the file.
    tell : callable
        Takes a line.
    mill : MillParams, optional
        Of the height field that is taken of the solid.
    undercut_free : bool
        Whether the solid becomes that height field, whose triangles are as many as its pixels are small.
    max_triangles : int, optional
        As in `make_relief`.

    Raises
    ------
    MeshError
        A mesh from which no relief, or no solid, can be made.
    ParameterError
        More pixels than a height field may have, or than there is memory for.
    """
    field_mb = 0.0
    if plate is None:
        found = estimate_relief(mesh, params, view, max_triangles=max_triangles)
        precision, unit = ".4g", "in the unit of the file: a surface, no solid (--width-mm)"
    else:
        found = estimate_solid(mesh, params, view, plate, max_triangles=max_triangles)
        precision, unit = ".2f", "mm"
        if mill is not None:
            columns, rows = check_pixels(*found.size[:2], mill.mm_per_pixel, about=True, solid=undercut_free)
            field_mb = field_memory(columns * rows, solid=undercut_free) / 1e6
    x, y, z = (format(side, precision) for side in found.size)
    tell(f"seen      {found.visible_depth:.4g} deep, in the unit of the file; --depth 100% is all of it")
    tell(f"size      {x} x {y} x {'' if found.depth_known else 'at most '}{z} {unit}")
    if found.volume_mm3 is not None:
        tell(f"volume    {'about' if found.depth_known else 'at most'} {found.volume_mm3 / 1000.0:.0f} cm3")
    finer = ", more where textures become colours" if mesh.has_textures() else ""
    finer += ", more in a height field" if undercut_free else ""
    tell(f"triangles about {found.triangles}{finer}")
    tell(f"memory    about {(found.memory_mb + field_mb) / 1000.0:.1f} GB")


def wall_picture(
    solid: Solid, plate: PlateParams, *, size: tuple[int, int] = (700, 700)
) -> NDArray[np.uint8]:
    """Draw where the walls are too thin, from the front and from the side.

    Parameters
    ----------
    solid : Solid
    plate : PlateParams
        What is thinner than its `min_wall_mm` is coloured by the millimetres that are missing.
    size : (width, height)
        Of each view, in pixels.

    Returns
    -------
    (h, w, 3) uint8
    """
    from o3d_relief.show.render import render, view_direction
    from o3d_relief.show.sheets import contact_sheet

    place, _, _, corners = solid.seam_split()
    thinnest = np.full(len(place), np.inf)
    np.minimum.at(thinnest, corners.ravel(), np.repeat(wall_thickness(solid), 3))
    mesh = o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector(solid.vertices[place]),
        o3d.utility.Vector3iVector(corners.astype(np.int32)),
    )
    missing = np.maximum(0.0, plate.min_wall_mm - thinnest)
    pictures = [
        render(
            mesh,
            direction=view_direction(yaw),
            size=size,
            field=missing,
            field_range=(0.0, plate.min_wall_mm),
            field_label="mm too thin",
            colormap="heat",
        )
        for yaw in (0, 55)
    ]
    return contact_sheet(pictures, 2)
