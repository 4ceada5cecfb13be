"""Light by rays: how much of a lamp and of the sky the points of a picture see.

Each point sends only one or two rays. Which ones is fixed by its place in the picture: a tile of 4 x 4
(lamp) or 8 x 8 (sky) neighbours shares one low-discrepancy set of directions, and a filter of the size of
the tile, which stays on the surface, gives everyone the mean of the whole set. No random numbers, so
equal input gives equal pictures.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import open3d as o3d

__all__ = ["cast_rays", "lamp_directions", "occluded", "sky_directions", "smooth_over_tile", "tile_index"]

Floats = NDArray[np.float32]


def cast_rays(
    scene: o3d.t.geometry.RaycastingScene, origins: Floats, direction: Floats
) -> tuple[NDArray[np.bool_], NDArray[np.int64], Floats, Floats]:
    """Shoot parallel rays.

    Parameters
    ----------
    origins : (r, 3) float32
    direction : (3,) float32

    Returns
    -------
    hit : (r,) bool
    face : (h,) int64
        Face of each ray that hits.
    weights : (h, 3) float32
        Barycentric coordinates there.
    distance : (h,) float32
    """
    import open3d as o3d

    rays = np.hstack([origins, np.broadcast_to(direction, origins.shape)]).astype(np.float32)
    answer = scene.cast_rays(o3d.core.Tensor.from_numpy(rays), nthreads=1)
    distance = answer["t_hit"].numpy()
    hit = np.isfinite(distance)
    uv = answer["primitive_uvs"].numpy()[hit]
    weights = np.column_stack([1.0 - uv[:, 0] - uv[:, 1], uv]).astype(np.float32)
    return hit, answer["primitive_ids"].numpy()[hit].astype(np.int64), weights, distance[hit]


def occluded(
    scene: o3d.t.geometry.RaycastingScene, origins: Floats, directions: Floats, *, length: float = np.inf
) -> NDArray[np.bool_]:
    """Tell which rays (r, 3) meet the scene within `length` times their direction's length."""
    import open3d as o3d

    rays = np.empty((len(origins), 6), dtype=np.float32)
    rays[:, :3], rays[:, 3:] = origins, directions
    result = np.zeros(len(rays), dtype=bool)
    good = slice(None) if np.isfinite(rays).all() else np.isfinite(rays).all(axis=1)
    if len(rays[good]):
        tensor = o3d.core.Tensor.from_numpy(np.ascontiguousarray(rays[good]))
        result[good] = scene.test_occlusions(tensor, tnear=0.0, tfar=float(length), nthreads=1).numpy()
    return result


def tile_index(rows: NDArray[np.int64], columns: NDArray[np.int64], bits: int) -> NDArray[np.int64]:
    """Give the places of a tile of 2**bits by 2**bits numbers, near places far ones (Bayer).

    Examples
    --------
    >>> tile_index(np.array([0, 0, 1, 1]), np.array([0, 1, 0, 1]), 1).tolist()
    [0, 2, 3, 1]
    """
    number = np.zeros_like(rows + columns)
    for bit in range(bits):
        y, x = (rows >> bit) & 1, (columns >> bit) & 1
        number += (((x ^ y) << 1) | y) << (2 * (bits - 1 - bit))
    return number


def lamp_directions(direction: NDArray[np.float64], radius_degrees: float, count: int) -> Floats:
    """Return directions (count, 3) to points spread over a round lamp."""
    index = np.arange(count) + 0.5
    radius = np.tan(np.deg2rad(radius_degrees)) * np.sqrt(index / count)
    angle = index * np.pi * (3.0 - np.sqrt(5.0))
    helper = np.eye(3)[int(np.argmin(np.abs(direction)))]
    across = np.cross(direction, helper)
    across /= np.linalg.norm(across)
    along = np.cross(direction, across)
    offset = np.cos(angle)[:, None] * across + np.sin(angle)[:, None] * along
    return np.asarray(direction + radius[:, None] * offset, dtype=np.float32)


def sky_directions(count: int, reach: float) -> tuple[Floats, Floats]:
    """Return points on the unit sphere (count, 3), and how far each ray looks (count,).

    A unit normal plus such a point is a cosine-weighted direction of the normal's hemisphere. The
    reaches are spread over 0 ... `reach`, so that near things count more than distant ones.
    """
    index = np.arange(count) + 0.5
    height = 1.0 - 2.0 * index / count
    angle = index * np.pi * (3.0 - np.sqrt(5.0))
    level = np.sqrt(1.0 - height**2)
    points = np.column_stack([level * np.cos(angle), level * np.sin(angle), height])
    spread = np.modf(index * 0.7548776662466927)[0]
    return points.astype(np.float32), (reach * spread).astype(np.float32)


def smooth_over_tile(value: Floats, depth: Floats, normal: Floats, pixel: float, width: int) -> Floats:
    """Average over a tile, but only over points that lie on the same surface.

    Parameters
    ----------
    value : (rows, columns) float32
    depth : (rows, columns) float32
        Distance towards the camera, NaN where nothing is seen.
    normal : (rows, columns, 3) float32
        In camera axes.
    pixel : float
        Distance of neighbouring points, in the unit of the depth.
    width : int
        Of the tile, even.

    Returns
    -------
    (rows, columns) float32
        First along the rows, then along the columns; a neighbour counts if it lies within two pixels of
        the tangent plane.
    """
    steps = range(-width // 2, width // 2)
    right, upward, upright = (np.ascontiguousarray(normal[..., axis]) for axis in range(3))
    for axis, slope in ((1, right), (0, -upward)):
        total = np.zeros_like(value)
        count = np.zeros_like(value)
        for step in steps:
            here, there = _shifted(axis, step)
            gap = depth[there] - depth[here]
            gap *= upright[here]
            gap += slope[here] * np.float32(step * pixel)
            near = np.abs(gap, out=gap) < 2.0 * pixel  # NaN is far
            total[here] += value[there] * near
            count[here] += near
        value = total / np.maximum(count, np.float32(1.0))
    return value


def _shifted(axis: int, step: int) -> tuple[tuple[slice, ...], tuple[slice, ...]]:
    """Return the slices of the places that have a neighbour `step` further, and of these neighbours."""
    here = slice(max(0, -step), -step if step > 0 else None)
    there = slice(max(0, step), step if step < 0 else None)
    full = (slice(None),) * axis
    return (*full, here), (*full, there)
