"""What a relief or a solid will measure, before the work."""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from o3d_relief.params import ReliefParams, View
from o3d_relief.plate_params import PlateParams
from o3d_relief.rays import unit_box
from o3d_relief.scene.convert import mesh_arrays
from o3d_relief.scene.frame import to_relief_units
from o3d_relief.solid.sizes import check_extents, scale_for
from o3d_relief.steps import frame_step, perspective_step, visibility_step, visible_depth

__all__ = ["Estimate", "estimate_relief", "estimate_solid", "front_size", "relief_depth"]

_LINES = 256
"""Lines along x and along y that measure how high the scene stands."""
_ATTENUATED, _BOUNDED = 0.45, 0.95
"""Heights in a relief over those in proportion, in each mode: 0.1 to 0.7 and 0.94 to 0.98 were measured."""
_MEGABYTES, _BYTES_PER_TRIANGLE = 600.0, 1000.0
"""Peak memory, measured on scenes of 20,000 to 870,000 triangles."""


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """What to expect.

    Attributes
    ----------
    size : (x, y, z)
        In millimetres for a solid, in the input's unit for a relief alone. Of a solid x, and z where a depth
        was asked for, are what it will measure. The rest can be smaller: parts that end behind the relief
        plane are cut off.
    visible_depth : float
        Depth of what is visible of the scene, in the input's unit.
    depth_known : bool
        False where no depth was asked for; z is then that of the scene, the most that it can be.
    volume_mm3 : float or None
        Roughly; None for a relief alone, which is a surface.
    triangles : int
        Of the scene; what is made of it has about as many.
    memory_mb : float
        Peak memory of the whole work, roughly, in megabytes.
    """

    size: tuple[float, float, float]
    visible_depth: float
    depth_known: bool
    volume_mm3: float | None
    triangles: int
    memory_mb: float


def estimate_solid(
    mesh: o3d.geometry.TriangleMesh,
    params: ReliefParams,
    view: View,
    plate: PlateParams,
    *,
    max_triangles: int | None = None,
) -> Estimate:
    """Estimate the solid's measures from the scene alone.

    Parameters
    ----------
    mesh : open3d.geometry.TriangleMesh
    params : ReliefParams
    view : View
    plate : PlateParams
    max_triangles : int, optional
        As in `make_relief`.

    Returns
    -------
    Estimate

    Raises
    ------
    MeshError
        A mesh from which no relief, or no solid, can be made.
    """
    vertices, faces, unit = _seen(mesh, view, max_triangles)
    used = vertices[np.unique(faces)]
    check_extents(used)
    scale = scale_for(used[:, :2], plate)
    width, height, scene_depth = np.ptp(used, axis=0) * scale
    seen_depth = _seen_depth(vertices, faces, unit, view)
    depth, known = _depth(params, seen_depth, scene_depth, scale / unit)
    if plate.depth_mm is not None:
        depth, known = plate.depth_mm - plate.back_mm, True
    covered, mean_height = _front(vertices, faces)
    total_height = _total_height(used, plate)
    share = {"rectangle": 1.0, "ellipse": np.pi / 4.0, "contour": covered, "none": 0.0}[plate.shape]
    volume = plate.width_mm * total_height * share * plate.back_mm
    volume += width * height * covered * mean_height * depth * (_BOUNDED if params.bounded else _ATTENUATED)
    return Estimate(
        size=(plate.width_mm, total_height, float(depth + plate.back_mm)),
        visible_depth=seen_depth,
        depth_known=known,
        volume_mm3=float(volume),
        triangles=len(faces),
        memory_mb=_memory_mb(faces),
    )


def estimate_relief(
    mesh: o3d.geometry.TriangleMesh, params: ReliefParams, view: View, *, max_triangles: int | None = None
) -> Estimate:
    """Estimate the measures of a relief without a plate from the scene alone.

    Parameters
    ----------
    mesh : open3d.geometry.TriangleMesh
    params : ReliefParams
    view : View
    max_triangles : int, optional
        As in `make_relief`.

    Returns
    -------
    Estimate

    Raises
    ------
    MeshError
        A mesh from which no relief can be made.
    """
    vertices, faces, unit = _seen(mesh, view, max_triangles)
    width, height, scene_depth = np.ptp(vertices[np.unique(faces)], axis=0) * unit
    seen_depth = _seen_depth(vertices, faces, unit, view)
    depth, known = _depth(params, seen_depth, scene_depth, 1.0)
    return Estimate(
        size=(float(width), float(height), depth),
        visible_depth=seen_depth,
        depth_known=known,
        volume_mm3=None,
        triangles=len(faces),
        memory_mb=_memory_mb(faces),
    )


def _depth(params: ReliefParams, seen_depth: float, most: float, scale: float) -> tuple[float, bool]:
    """Return the depth that was asked for, in the input's unit times `scale`, and whether it will be met."""
    wanted = params.settled(seen_depth).depth
    if wanted is None:
        return float(most), False
    scaled = cast(float, wanted) * scale
    return float(min(most, scaled)), bool(scaled <= most)


def _seen_depth(vertices: NDArray[np.float64], faces: NDArray[np.int64], unit: float, view: View) -> float:
    """Return the depth of what is visible, in the input's unit."""
    return visible_depth(vertices, visibility_step(vertices, faces, view).visible) * unit


def _memory_mb(faces: NDArray[np.int64]) -> float:
    return _MEGABYTES + _BYTES_PER_TRIANGLE * len(faces) / 1e6


def front_size(
    mesh: o3d.geometry.TriangleMesh, view: View, plate: PlateParams, *, max_triangles: int | None = None
) -> tuple[float, float]:
    """Estimate the solid's width and height in millimetres, which takes far less time than all of it.

    Parameters
    ----------
    mesh : open3d.geometry.TriangleMesh
    view : View
    plate : PlateParams
    max_triangles : int, optional
        As in `make_relief`.

    Returns
    -------
    width, height : float
        As in `Estimate.size`.

    Raises
    ------
    MeshError
        A mesh from which no relief, or no solid, can be made.
    """
    vertices, faces, _ = _seen(mesh, view, max_triangles)
    used = vertices[np.unique(faces)]
    check_extents(used)
    return plate.width_mm, _total_height(used, plate)


def _total_height(used: NDArray[np.float64], plate: PlateParams) -> float:
    """Return the height of the whole object, margin and frame included, in millimetres."""
    width, height, _ = np.ptp(used, axis=0)
    return float((plate.width_mm - 2.0 * plate.edge_mm) * height / width + 2.0 * plate.edge_mm)


def relief_depth(
    mesh: o3d.geometry.TriangleMesh, view: View, plate: PlateParams, *, max_triangles: int | None = None
) -> float | None:
    """Return the depth of the relief, in the input's unit, that gives the solid's depth in millimetres.

    Parameters
    ----------
    mesh : open3d.geometry.TriangleMesh
    view : View
    plate : PlateParams
    max_triangles : int, optional
        As in `make_relief`.

    Returns
    -------
    float or None
        None where the plate asks for no depth.

    Raises
    ------
    MeshError
        A mesh from which no relief can be made.
    """
    if plate.depth_mm is None:
        return None
    vertices, faces, unit = _seen(mesh, view, max_triangles)
    scale = scale_for(vertices[np.unique(faces), :2], plate)
    return (plate.depth_mm - plate.back_mm) / scale * unit


def _seen(
    mesh: o3d.geometry.TriangleMesh, view: View, max_triangles: int | None
) -> tuple[NDArray[np.float64], NDArray[np.int64], float]:
    """Return the scene as the relief takes it: vertices in relief units, faces, and the unit."""
    vertices, faces = mesh_arrays(mesh, max_triangles)
    frame = frame_step(vertices, faces, view)
    placed = perspective_step(to_relief_units(vertices, frame, on_grid=True), view).vertices
    return placed, faces, frame.unit


def _front(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> tuple[float, float]:
    """Return the share of the extents that the scene covers, and its mean height there, from 0 to 1."""
    scene, middle, size = unit_box(vertices, faces)
    used = (vertices[np.unique(faces)] - middle) / size
    low, high = used.min(axis=0), used.max(axis=0)
    steps = (np.arange(_LINES) + 0.5) / _LINES
    x, y = np.meshgrid(low[0] + steps * (high[0] - low[0]), low[1] + steps * (high[1] - low[1]))
    start = np.stack([x.ravel(), y.ravel(), np.full(x.size, high[2] + 0.1)], axis=1)
    rays = np.concatenate([start, np.tile([0.0, 0.0, -1.0], (x.size, 1))], axis=1).astype(np.float32)
    t = scene.cast_rays(o3d.core.Tensor(rays))["t_hit"].numpy().astype(np.float64)
    met = np.isfinite(t)
    heights = (high[2] + 0.1 - t[met] - low[2]) / max(float(high[2] - low[2]), 1e-300)
    return float(met.mean()), float(heights.mean()) if met.any() else 0.0
