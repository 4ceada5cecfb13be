"""The two panels of each stage of a scan that becomes a mesh."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from o3d_relief.params import Triple
from o3d_relief.scan_records import (
    GroundStage,
    NormalsStage,
    OrientationStage,
    OutliersStage,
    PartsStage,
    PointsStage,
    SkinStage,
    SurfaceStage,
)
from o3d_relief.scene.frame import Frame, relief_frame, to_relief_units
from o3d_relief.show.easel import OBLIQUE, Easel, Pictures
from o3d_relief.show.render import render

if TYPE_CHECKING:
    import open3d as o3d

__all__ = ["SCAN_PANELS"]

_MOST_DOTS = 150_000
_DOT = 1.1  # spacings
_STONE, _GONE, _FLOOR = (0.80, 0.78, 0.74), (0.83, 0.15, 0.12), (0.55, 0.42, 0.30)
_FRONT = (0.0, 0.0, 1.0)
_DISTANCES = (0.0, 5.0)  # spacings


def _frame(easel: Easel) -> Frame:
    """Return the frame in which everything is drawn: that of a relief of the points without outliers."""
    record = easel.record(PointsStage)
    outliers = easel.stages.get("outliers")
    kept = (
        ~outliers.outlier if isinstance(outliers, OutliersStage) else np.ones(len(record.points), dtype=bool)
    )
    return relief_frame(
        record.points[kept], cast(Triple, record.view.front), cast(Triple, record.view.up)
    )  # View has checked and converted both


def _mesh(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    frame: Frame,
    colors: NDArray[np.float64] | None = None,
) -> o3d.geometry.TriangleMesh:
    """Return a mesh in the frame in which everything is drawn."""
    from o3d_relief.scene.arrays import MeshArrays, to_open3d

    return to_open3d(MeshArrays(vertices=to_relief_units(vertices, frame), faces=faces, colors=colors))


def _draw(
    easel: Easel,
    shown: NDArray[np.bool_],
    colors: NDArray[np.float64],
    title: str,
    *,
    normals: NDArray[np.float64] | None = None,
    legend: list[tuple[ArrayLike, str]] | None = None,
) -> Pictures:
    """Draw points (n,) as small triangles, across their normals or else across the view, from two sides."""
    record, frame = easel.record(PointsStage), _frame(easel)
    chosen = np.flatnonzero(shown)
    step = -(-len(chosen) // _MOST_DOTS)
    chosen = chosen[:: max(step, 1)]
    radius = _DOT * record.spacing / frame.unit * np.sqrt(max(step, 1))
    points = to_relief_units(record.points[chosen], frame)
    bounds = _box(easel, frame)
    pictures = []
    for direction, words in ((_FRONT, title), (OBLIQUE, "from the side")):
        across = np.tile(np.asarray(direction, dtype=np.float64), (len(chosen), 1))
        if normals is not None:
            across = normals[chosen] @ frame.rotation.T
        mesh = _triangles(points, across, radius)
        pictures.append(
            render(
                mesh,
                size=easel.size,
                direction=direction,
                colors=np.repeat(colors[chosen], 3, axis=0),
                crease=0.0,
                bounds=bounds,
                title=words,
                legend=legend or (),
            )
        )
    return pictures


def _box(easel: Easel, frame: Frame) -> NDArray[np.float64]:
    outliers = easel.stages.get("outliers")
    points = easel.record(PointsStage).points
    if isinstance(outliers, OutliersStage):
        points = points[~outliers.outlier]
    points = to_relief_units(points, frame)
    return np.array([points.min(axis=0), points.max(axis=0)])


def _triangles(
    points: NDArray[np.float64], across: NDArray[np.float64], radius: float
) -> o3d.geometry.TriangleMesh:
    """Return an equilateral triangle at each point (n, 3), across its direction (n, 3), of this radius."""
    from o3d_relief.scene.arrays import MeshArrays, to_open3d

    axis = np.eye(3)[np.argmin(np.abs(across), axis=1)]
    right = np.cross(axis, across)
    right /= np.linalg.norm(right, axis=1, keepdims=True)
    above = np.cross(across, right)
    angle = np.pi / 2 + np.arange(3) * 2 * np.pi / 3
    corners = radius * (
        np.cos(angle)[None, :, None] * right[:, None] + np.sin(angle)[None, :, None] * above[:, None]
    )
    vertices = (points[:, None] + corners).reshape(-1, 3)
    return to_open3d(MeshArrays(vertices=vertices, faces=np.arange(len(vertices)).reshape(-1, 3)))


def _chosen(mask: NDArray[np.bool_], yes: ArrayLike, no: ArrayLike) -> NDArray[np.float64]:
    return np.where(mask[:, None], np.asarray(yes, dtype=np.float64), np.asarray(no, dtype=np.float64))


def _used(normals: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which points have a normal."""
    return np.asarray(normals.any(axis=1))


def _points(easel: Easel) -> Pictures:
    record = easel.record(PointsStage)
    count = len(record.points)
    colors = np.tile(_STONE, (count, 1)) if record.colors is None else np.clip(record.colors, 0.0, 1.0)
    title = f"points: {count}, {record.spacing:.3g} apart"
    return _draw(easel, np.ones(count, dtype=bool), colors, title)


def _outliers(easel: Easel) -> Pictures:
    far = easel.record(OutliersStage).outlier
    legend: list[tuple[ArrayLike, str]] = [(_GONE, f"outliers: {int(far.sum())}")]
    return _draw(easel, np.ones(len(far), dtype=bool), _chosen(far, _GONE, _STONE), "outliers", legend=legend)


def _normals(easel: Easel) -> Pictures:
    record = easel.record(NormalsStage)
    title = "normals, the cloud's own" if record.from_file else "normals, estimated"
    turned = record.normals @ _frame(easel).rotation.T
    return _draw(easel, _used(record.normals), np.abs(turned), f"{title}: |x|, |y|, |z| as colours")


def _ground(easel: Easel) -> Pictures:
    ground = easel.record(GroundStage).ground
    shown = _used(easel.record(NormalsStage).normals)
    count = int(ground.sum())
    legend: list[tuple[ArrayLike, str]] = [(_FLOOR, f"ground: {count}")]
    title = "ground" if count else "ground: none is removed"
    return _draw(easel, shown, _chosen(ground, _FLOOR, _STONE), title, legend=legend if count else None)


def _orientation(easel: Easel) -> Pictures:
    record = easel.record(OrientationStage)
    turned = record.normals @ _frame(easel).rotation.T
    return _draw(
        easel,
        _used(record.normals),
        np.clip(0.5 + 0.5 * turned, 0.0, 1.0),
        f"oriented normals, by {record.method}: dark from behind",
        normals=record.normals,
    )


def _surface(easel: Easel) -> Pictures:
    record, frame = easel.record(SurfaceStage), _frame(easel)
    mesh = _mesh(record.vertices, record.faces, frame)
    title = f"Poisson surface of depth {record.depth}: {len(record.faces)} faces"
    return [
        render(mesh, size=easel.size, title=title),
        render(mesh, size=easel.size, direction=OBLIQUE, title="from the side"),
    ]


def _skin(easel: Easel) -> Pictures:
    surface, record, frame = easel.record(SurfaceStage), easel.record(SkinStage), _frame(easel)
    before = _mesh(surface.vertices, surface.faces, frame)
    after = _mesh(record.vertices, record.faces, frame)
    measured = render(
        before,
        size=easel.size,
        direction=OBLIQUE,
        field=np.clip(record.distance, *_DISTANCES),
        field_range=_DISTANCES,
        field_label="spacings",
        colormap="heat",
        title="distance to the nearest point",
    )
    bounds = np.array([before.get_min_bound(), before.get_max_bound()])
    return [
        measured,
        render(after, size=easel.size, direction=OBLIQUE, bounds=bounds, title="without what is invented"),
    ]


def _parts(easel: Easel) -> Pictures:
    record, frame = easel.record(PartsStage), _frame(easel)
    mesh = _mesh(record.vertices, record.faces, frame, record.colors)
    dropped = record.counts.get("parts_dropped", 0)
    return [
        render(mesh, size=easel.size, title=f"the mesh: {len(record.faces)} faces, {dropped} parts dropped"),
        render(mesh, size=easel.size, direction=OBLIQUE, title="from the side"),
    ]


SCAN_PANELS: Mapping[str, Callable[[Easel], Pictures]] = {
    "points": _points,
    "outliers": _outliers,
    "normals": _normals,
    "ground": _ground,
    "orientation": _orientation,
    "surface": _surface,
    "skin": _skin,
    "parts": _parts,
}
"""What draws each stage of a scan, in the order of the stages."""
