"""Measurements on a finished mesh, without the library that made it."""

from __future__ import annotations

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from o3d_relief.plate_params import PlateParams
from o3d_relief.rays import unit_box
from o3d_relief.solid.body import Solid

__all__ = [
    "back_deviation",
    "edges_paired",
    "overhang_area",
    "overlap_share",
    "quantile",
    "wall_thickness",
    "walls_sampled",
    "winding_number",
]

_MOST_POINTS = 2000
"""Points at most on a face, on each of which the wall is measured."""
_LINES = 400
"""Lines along x and along y on which the inside is followed through the solid."""


def wall_thickness(solid: Solid) -> NDArray[np.float64]:
    """Measure the wall behind each face, straight into the solid.

    Parameters
    ----------
    solid : Solid

    Returns
    -------
    (m,) float64
        In millimetres, from the face to where the ray leaves the solid; the least of what was found behind
        its points, one for each square millimetre.
    """
    face, _, walls = walls_sampled(solid)
    least = np.full(len(solid.faces), np.inf)
    np.minimum.at(least, face, walls)
    return least


def walls_sampled(solid: Solid) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Measure the wall behind points spread over the surface.

    Returns
    -------
    face : (p,) int64
        Face of each point.
    share : (p,) float64
        Area that it stands for.
    wall : (p,) float64
    """
    scene, middle, size = unit_box(solid.vertices, solid.faces)
    corners = solid.vertices[solid.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    unit = np.where(length > 0.0, normals / np.where(length > 0.0, length, 1.0), [0.0, 0.0, 1.0])
    area = length[:, 0] / 2.0
    count = np.clip(np.ceil(area), 1, _MOST_POINTS).astype(np.int64)
    face = np.repeat(np.arange(len(area)), count)
    number = np.arange(len(face)) - np.repeat(np.cumsum(count) - count, count)
    # Evenly over each triangle: a square of low discrepancy, folded; the first point is near the middle.
    u, v = (0.35 + number * 0.7548776662466927) % 1.0, (0.32 + number * 0.5698402909980532) % 1.0
    fold = u + v > 1.0
    u, v = np.where(fold, 1.0 - u, u), np.where(fold, 1.0 - v, v)
    points = (
        (1.0 - u - v)[:, None] * corners[face, 0]
        + u[:, None] * corners[face, 1]
        + v[:, None] * corners[face, 2]
    )
    # float32 rays start a hair inside, or they would hit their own face.
    start = (points - middle) / size - 1e-5 * unit[face]
    rays = np.concatenate([start, -unit[face]], axis=1).astype(np.float32)
    hit = scene.cast_rays(o3d.core.Tensor(rays))["t_hit"].numpy().astype(np.float64)
    return face, (area / count)[face], np.where(np.isfinite(hit), (hit + 1e-5) * size, 0.0)


def edges_paired(faces: NDArray[np.int64]) -> tuple[bool, bool]:
    """Test that every edge has exactly two faces, and that these run along it in opposite directions."""
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    count = int(faces.max()) + 1
    _, times = np.unique(np.minimum(start, end) * count + np.maximum(start, end), return_counts=True)
    forward, backward = np.sort(start * count + end), np.sort(end * count + start)
    return bool((times == 2).all()), bool(np.array_equal(forward, backward))


def back_deviation(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    normals: NDArray[np.float64],
    params: PlateParams,
) -> float:
    """Measure the corners of the faces that turn to the back and lie in its plane, roughly."""
    z = vertices[faces, 2] + params.back_mm
    facing = normals[:, 2] < -0.999 * np.linalg.norm(normals, axis=1)
    back = facing & (np.abs(z) < 0.1).all(axis=1)
    return float(np.abs(z[back]).max()) if back.any() else -1.0


def overlap_share(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> float:
    """Follow lines from the viewer to the back: inside, each place must be entered once."""
    scene, middle, size = unit_box(vertices, faces)
    low, high = (vertices.min(axis=0) - middle) / size, (vertices.max(axis=0) - middle) / size
    # Off the symmetric places, where lines would run along edges.
    steps = (np.arange(_LINES) + 0.5137) / _LINES
    x, y = np.meshgrid(low[0] + steps * (high[0] - low[0]), low[1] + steps * (high[1] - low[1]))
    start = np.stack([x.ravel(), y.ravel(), np.full(x.size, high[2] + 0.1)], axis=1)
    rays = np.concatenate([start, np.tile([0.0, 0.0, -1.0], (x.size, 1))], axis=1).astype(np.float32)
    hits = scene.list_intersections(o3d.core.Tensor(rays))
    line, t = hits["ray_ids"].numpy().astype(np.int64), hits["t_hit"].numpy().astype(np.float64)
    a, b, c = vertices[faces[hits["primitive_ids"].numpy()]].transpose(1, 0, 2)
    entered = np.sign(np.cross(b - a, c - a)[:, 2])
    order = np.lexsort((t, line))
    line, t, entered = line[order], t[order], entered[order]
    inside = np.cumsum(entered)
    same = line[1:] == line[:-1]
    # Lines that hit an edge see one face too many: they are left out.
    total = np.bincount(line, weights=entered, minlength=x.size)
    clean = total[line] == 0.0
    inside = inside - (np.cumsum(total) - total)[line]
    length = np.where(same & clean[1:], np.diff(t), 0.0)
    solid, wrong = inside[:-1] > 0.0, (inside[:-1] > 1.0) | (inside[:-1] < 0.0)
    return float(length[wrong].sum() / max(length[solid].sum(), 1e-300))


def overhang_area(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    normals: NDArray[np.float64],
    area: NDArray[np.float64],
    params: PlateParams,
) -> float:
    """Add up the area (mm2) that leans out too far in the print direction, without what lies on the bed."""
    axis = {"x": 0, "y": 1, "z": 2}[params.print_direction]
    steep = normals[:, axis] < -np.sin(np.radians(params.overhang_degrees)) * area
    along = vertices[faces, axis]
    on_bed = (along - vertices[:, axis].min() < 1e-3).all(axis=1)
    return float(area[steep & ~on_bed].sum())


def quantile(values: NDArray[np.float64], weights: NDArray[np.float64], share: float) -> float:
    """Return the value below which a share of the weights lies."""
    order = np.argsort(values)
    cumulated = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(cumulated, share * cumulated[-1])])


def winding_number(
    point: NDArray[np.float64], vertices: NDArray[np.float64], faces: NDArray[np.int64]
) -> float:
    """Count how often closed surfaces go round a point: the solid angles of their faces, over 4 pi.

    Van Oosterom & Strackee, The Solid Angle of a Plane Triangle, 1983.

    Parameters
    ----------
    point : (3,) float64
        On none of the faces.
    vertices : (n, 3) float64
    faces : (m, 3) int64

    Returns
    -------
    float
        1 inside of a body, 0 outside and in its voids, but for rounding.

    Examples
    --------
    >>> v = np.array([[0, 0, 0], [3, 0, 0], [0, 3, 0], [0, 0, 3.0]])
    >>> f = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    >>> [round(winding_number(np.full(3, x), v, f), 6) + 0.0 for x in (0.5, 2.0)]
    [1.0, 0.0]
    """
    a, b, c = (vertices - point)[faces].transpose(1, 0, 2)
    la, lb, lc = (np.linalg.norm(side, axis=1) for side in (a, b, c))
    over = np.einsum("ij,ij->i", a, np.cross(b, c))
    under = la * lb * lc + sum(
        np.einsum("ij,ij->i", one, two) * length for one, two, length in ((a, b, lc), (b, c, la), (c, a, lb))
    )
    return float(np.arctan2(over, under).sum()) / (2.0 * np.pi)
