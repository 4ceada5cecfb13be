"""One body: what is loose, what is hollow."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from o3d_relief.errors import MeshError
from o3d_relief.plate_params import PlateParams
from o3d_relief.rays import unit_box
from o3d_relief.solid.body import built
from o3d_relief.solid.chain import bodies
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

    Raises
    ------
    MeshError
        There is no body of positive volume.
    """
    import manifold3d

    if whole.is_empty() or whole.volume() <= 0.0:
        raise MeshError("Nothing of the relief has a volume: no solid can be made of it.")
    properties, corners, target, label = _labelled(whole)
    volumes, rear = _measured(properties[:, :3], corners, label)
    crumb = _crumbs(volumes, params)
    solid = (volumes > 0.0) & ~crumb
    counts = {"voids_filled": float((volumes <= 0.0).sum()), "crumbs": float(crumb.sum())}
    # The plate is the rearmost; without one, the largest body is the main one.
    kept = np.flatnonzero(solid)
    key = rear[kept] if params.shape != "none" else np.zeros(len(kept))
    main = int(kept[np.lexsort((-volumes[kept], key))[0]])
    counts["loose_bodies"] = float(len(kept) - 1)
    counts["loose_mm3"] = float(volumes[kept].sum() - volumes[main])
    counts["pins"] = 0.0
    if params.loose == "remove":
        kept = np.array([main])
    if len(kept) == len(volumes) and (params.loose == "report" or len(kept) == 1):
        return whole, counts
    # What is loose may lie in what was a void.
    together = params.loose == "report" and (len(kept) == 1 or not (volumes <= 0.0).any())
    others = [np.array([number]) for number in kept if number != main]
    groups = [kept] if together or not others else [np.array([main]), *others]
    made = [_only(properties, corners, target, np.isin(label, group)) for group in groups]
    if params.loose == "bridge" and len(made) > 1:
        pins = _pins(made[0], made[1:], params)
        counts["pins"] = float(len(pins))
        made += pins
    if len(made) == 1:
        # manifold3d may part what touched itself in a vertex only.
        result, more = joined(made[0], params)
        told = (
            counts
            if params.loose == "remove"
            else {name: counts[name] for name in ("voids_filled", "crumbs")}
        )
        return result, {name: value + told.get(name, 0.0) for name, value in more.items()}
    union, more = _swept(manifold3d.Manifold.batch_boolean(made, manifold3d.OpType.Add), params)
    return union, counts | {name: counts[name] + count for name, count in more.items()}


def _labelled(
    whole: manifold3d.Manifold,
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Return vertices with properties, faces, what each vertex is merged into, and the body of each face."""
    mesh = whole.to_mesh64()
    properties, corners = np.asarray(mesh.vert_properties), np.asarray(mesh.tri_verts).astype(np.int64)
    target = np.arange(len(properties))
    target[np.asarray(mesh.merge_from_vert, dtype=np.int64)] = np.asarray(mesh.merge_to_vert, dtype=np.int64)
    return properties, corners, target, bodies(target[corners])


def _crumbs(volumes: NDArray[np.float64], params: PlateParams) -> NDArray[np.bool_]:
    """Tell which bodies are smaller than a drop from the nozzle."""
    return np.asarray((volumes > 0.0) & (volumes < params.nozzle_mm**3) & (volumes < volumes.max()))


def _swept(whole: manifold3d.Manifold, params: PlateParams) -> tuple[manifold3d.Manifold, dict[str, float]]:
    """Leave out the crumbs that a union has made, and fill its voids; return their numbers, too.

    Where there are several bodies, one may lie in a void: then only those of a crumb's size are filled.
    """
    counts = {"voids_filled": 0.0, "crumbs": 0.0}
    while True:
        properties, corners, target, label = _labelled(whole)
        volumes, _ = _measured(properties[:, :3], corners, label)
        crumb, void = _crumbs(volumes, params), volumes <= 0.0
        if (volumes > 0.0).sum() - crumb.sum() > 1:
            void &= -volumes < params.nozzle_mm**3
        if not (crumb | void).any():
            return whole, counts
        counts["voids_filled"] += float(void.sum())
        counts["crumbs"] += float(crumb.sum())
        # manifold3d may part what touched itself in a vertex only: then there are new ones.
        whole = _only(properties, corners, target, ~(crumb | void)[label])


def _measured(
    places: NDArray[np.float64], corners: NDArray[np.int64], label: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the volume of each body (b,) and its lowest z."""
    a, b, c = places[corners].transpose(1, 0, 2)
    volumes = np.bincount(label, weights=np.einsum("ij,ij->i", a, np.cross(b, c)) / 6.0)
    rear = np.full(len(volumes), np.inf)
    np.minimum.at(rear, label, places[corners, 2].min(axis=1))
    return np.asarray(volumes, dtype=np.float64), rear


def _only(
    properties: NDArray[np.float64],
    corners: NDArray[np.int64],
    target: NDArray[np.int64],
    rows: NDArray[np.bool_],
) -> manifold3d.Manifold:
    """Make a manifold of some faces; vertices that are merged into another one come with it."""
    used = np.unique(np.concatenate([corners[rows], target[corners[rows]]]))
    number = np.full(len(properties), -1)
    number[used] = np.arange(len(used))
    merged = used[target[used] != used]
    return built(properties[used], number[corners[rows]], number[merged], number[target[merged]])


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
