"""One body: what is loose, what is hollow."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from o3d_relief.plate_params import PlateParams
from o3d_relief.rays import unit_box
from o3d_relief.solid.plate import as_plate

if TYPE_CHECKING:
    import manifold3d

__all__ = ["joined"]


def joined(whole: manifold3d.Manifold, params: PlateParams) -> tuple[manifold3d.Manifold, dict[str, float]]:
    """Fill what is hollow and settle what is loose.

    Parameters
    ----------
    whole : manifold3d.Manifold
    params : PlateParams
        `loose` says what becomes of bodies apart from the one that reaches furthest back.

    Returns
    -------
    manifold3d.Manifold
    counts : dict of str to float
        Voids filled, crumbs (smaller than a drop from the nozzle) left out, and the loose bodies with
        their volume in cubic millimetres, as they were before they were bridged or removed.
    """
    import manifold3d

    pieces = whole.decompose()
    volumes = np.array([piece.volume() for piece in pieces])
    crumb = (volumes > 0.0) & (volumes < params.nozzle_mm**3) & (volumes < volumes.max())
    kept_rows = np.flatnonzero((volumes > 0.0) & ~crumb)
    solid, size = [pieces[row] for row in kept_rows], volumes[kept_rows]
    counts = {"voids_filled": float((volumes <= 0.0).sum()), "crumbs": float(crumb.sum())}
    # The plate is the rearmost; without one, the largest body is the main one.
    rear = np.array([piece.bounding_box()[2] for piece in solid])
    main = int(np.lexsort((-size, rear if params.shape != "none" else np.zeros(len(size))))[0])
    loose = [piece for number, piece in enumerate(solid) if number != main]
    counts["loose_bodies"] = float(len(loose))
    counts["loose_mm3"] = float(size.sum() - size[main])
    kept = [solid[main], *loose]
    if params.loose == "remove":
        kept = kept[:1]
    pins: list[manifold3d.Manifold] = []
    if params.loose == "bridge" and loose:
        pins = _pins(solid[main], loose, params)
    counts["pins"] = float(len(pins))
    if len(pieces) == 1 or (len(kept) == len(pieces) and not pins):
        return whole, counts
    return manifold3d.Manifold.batch_boolean([*kept, *pins], manifold3d.OpType.Add), counts


def _pins(
    main: manifold3d.Manifold, loose: list[manifold3d.Manifold], params: PlateParams
) -> list[manifold3d.Manifold]:
    """Tie each loose body to what lies behind it, where it is closest to it."""
    import manifold3d

    scene, middle, size = unit_box(*_triangles(main))
    radius = max(params.min_wall_mm, params.thickness_mm / 2.0)
    pins = []
    for body in loose:
        start, room = _rear_points(body)
        rays = np.column_stack([(start - middle) / size, np.tile([0.0, 0.0, -1.0], (len(start), 1))])
        gap = scene.cast_rays(o3d.core.Tensor(rays.astype(np.float32)))["t_hit"].numpy() * size
        best = int(gap.argmin())
        if not np.isfinite(gap[best]):
            continue
        # A radius deep into both, but never through the body or the plate: the ends do not show.
        x, y, z = start[best]
        high = z + min(radius, 0.9 * float(room[best]))
        low = max(z - float(gap[best]) - radius, -params.back_mm / 2.0)
        pin = manifold3d.Manifold.cylinder(high - low, radius, radius, 32)
        pins.append(as_plate(pin.translate((x, y, low))))
    return pins


def _rear_points(body: manifold3d.Manifold) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Find the middles (q, 3) of the faces at the back of a body, and how thick it is before them, (q,)."""
    vertices, faces = _triangles(body)
    scene, middle, size = unit_box(vertices, faces)
    points = vertices[faces].mean(axis=1)
    a, b, c = vertices[faces].transpose(1, 0, 2)
    points = points[np.cross(b - a, c - a)[:, 2] < 0.0]
    start = (points - middle) / size - [0.0, 0.0, 1e-4]
    rays = np.column_stack([start, np.tile([0.0, 0.0, -1.0], (len(start), 1))])
    hidden = scene.test_occlusions(o3d.core.Tensor(rays.astype(np.float32))).numpy()
    points = points[~hidden] if (~hidden).any() else points
    start = (points - middle) / size + [0.0, 0.0, 1e-5]
    rays = np.column_stack([start, np.tile([0.0, 0.0, 1.0], (len(start), 1))])
    room = scene.cast_rays(o3d.core.Tensor(rays.astype(np.float32)))["t_hit"].numpy() * size
    return points, np.where(np.isfinite(room), room, 0.0)


def _triangles(body: manifold3d.Manifold) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    mesh = body.to_mesh64()
    return np.asarray(mesh.vert_properties)[:, :3].copy(), np.asarray(mesh.tri_verts).astype(np.int64)
