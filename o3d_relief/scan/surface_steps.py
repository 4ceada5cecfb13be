"""The steps from oriented normals to a mesh: each takes what those before have found, returns its record."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from o3d_relief.errors import MeshError
from o3d_relief.progress import Tick, silent
from o3d_relief.scan.poisson import depth_for, poisson_surface
from o3d_relief.scan.skin import carry_colors, keep_parts, support, used_only
from o3d_relief.scan.steps import Work
from o3d_relief.scan_params import ScanParams
from o3d_relief.scan_records import OrientationStage, PartsStage, PointsStage, SkinStage, SurfaceStage
from o3d_relief.stages.trim import trim_behind

__all__ = ["parts_step", "skin_step", "surface_step"]

_FINEST = 1e-12
"""Least spacing, as a share of the cloud's size: points that are closer have no spacing to speak of."""

_WIDEST = 4.0
"""The spacing around a single point counts up to so many times the median."""


def surface_step(
    work: Work, oriented: OrientationStage, params: ScanParams, *, tick: Tick = silent
) -> SurfaceStage:
    """Lay a closed surface through the points."""
    used = oriented.normals.any(axis=1)
    points = work.points[used]
    spacing = float(np.median(work.local_spacing[used]))
    depth = params.depth
    if depth is None:
        depth = depth_for(float(np.ptp(points, axis=0).max()), spacing)
    vertices, faces, density = poisson_surface(
        points, oriented.normals[used], depth=depth, threads=params.threads, tick=tick
    )
    return SurfaceStage(
        vertices=work.back(vertices),
        faces=faces,
        density=density,
        depth=depth,
        counts={"depth": depth, "vertices": len(vertices), "faces": len(faces)},
    )


def skin_step(work: Work, oriented: OrientationStage, surface: SurfaceStage, params: ScanParams) -> SkinStage:
    """Cut away what of the surface no points support."""
    used = oriented.normals.any(axis=1)
    # Along the border of a scan circles are half empty; the neighbours further in know better.
    around = np.percentile(work.local_spacing[work.neighbours.index[used]], 25.0, axis=1)
    local = np.minimum(around, _WIDEST * float(np.median(work.local_spacing[used])))
    local = np.maximum(local, _FINEST)
    vertices = (surface.vertices - work.centre) / work.size
    distance, nearest = cKDTree(work.points[used]).query(vertices, workers=-1)
    distance = distance / local[nearest]
    inside = support(surface.faces, distance, surface.density, params.max_hole)
    # The support takes the place of the height over the plane at which reliefs are cut.
    heights = np.column_stack([np.zeros((len(inside), 2)), inside])
    cut = trim_behind(heights, surface.faces, np.ones(len(inside), dtype=bool))
    if len(cut.faces) == 0:
        raise MeshError("Nothing of the surface lies near the points: the cloud is too sparse or too noisy.")
    return SkinStage(
        distance=distance,
        vertices=work.back(cut.to_vertices(vertices)),
        faces=cut.faces,
        counts={"faces": len(cut.faces), "faces_dropped": cut.faces_dropped},
    )


def parts_step(
    points: PointsStage, oriented: OrientationStage, skin: SkinStage, params: ScanParams
) -> PartsStage:
    """Keep the parts that are large enough and colour them."""
    kept, dropped = keep_parts(skin.vertices, skin.faces, params.min_part)
    index, faces = used_only(skin.faces[kept], len(skin.vertices))
    vertices = skin.vertices[index]
    used = oriented.normals.any(axis=1)
    colors = None
    if points.colors is not None:
        colors = carry_colors(vertices, points.points[used], points.colors[used])
    return PartsStage(
        vertices=vertices,
        faces=faces,
        colors=colors,
        counts={"parts_dropped": dropped, "vertices": len(vertices), "faces": len(faces)},
    )
