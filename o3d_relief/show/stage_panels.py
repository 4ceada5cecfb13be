"""The two panels of each stage that gives the scene another shape, and the table of all stages."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from o3d_relief.records import (
    BoundedStage,
    CompressionStage,
    ConstructionStage,
    OrderStage,
    RestorationStage,
    SceneStage,
    TrimStage,
    VisibilityStage,
    final_heights,
)
from o3d_relief.show.annotate import annotate
from o3d_relief.show.camera import view_direction
from o3d_relief.show.easel import OBLIQUE, SIDE, STILL, Easel, Pictures
from o3d_relief.show.render import render
from o3d_relief.show.scene_panels import SCENE_PANELS

__all__ = ["PANELS"]

Vector = tuple[float, float, float]

_FRONT: Vector = (0.0, 0.0, 1.0)
_NEAR_FRONT = view_direction(22.0, 10.0)
_GAP = 4  # pixels


def _bounds(*surfaces: NDArray[np.float64]) -> NDArray[np.float64]:
    low = np.min([vertices.min(axis=0) for vertices in surfaces], axis=0)
    return np.array([low, np.max([vertices.max(axis=0) for vertices in surfaces], axis=0)])


def _close_up(vertices: NDArray[np.float64], worst: int) -> NDArray[np.float64]:
    """Return a box of 30 relief units around a vertex."""
    return np.array([vertices[worst] - 15.0, vertices[worst] + 15.0])


def _pair(
    easel: Easel,
    surfaces: tuple[NDArray[np.float64], NDArray[np.float64]],
    titles: tuple[str, str],
    *,
    direction: ArrayLike,
    plate: bool = False,
) -> Pictures:
    """Draw a surface before and after, in one framing; only once where it is the same."""
    bounds = _bounds(*surfaces)

    def drawn(vertices: NDArray[np.float64], title: str) -> NDArray[np.uint8]:
        mesh = easel.mesh(vertices)
        return render(mesh, size=easel.size, direction=direction, plate=plate, bounds=bounds, title=title)

    if not np.array_equal(*surfaces):
        return [drawn(vertices, title) for vertices, title in zip(surfaces, titles, strict=True)]
    picture = drawn(surfaces[0], " ")  # with room for a title
    return [annotate(picture, title=title, legend=(), bar=None) for title in titles]


def _perspective(easel: Easel) -> Pictures:
    before, after = easel.record(SceneStage).vertices, easel.vertices
    changed = not np.array_equal(before, after)
    titles = ("before the forced perspective", "after" if changed else "after: no vanishing point, unchanged")
    return _pair(easel, (before, after), titles, direction=OBLIQUE)


def _construction(easel: Easel) -> Pictures:
    z = easel.record(ConstructionStage).z
    vertices = easel.raised(z)
    mesh = easel.mesh(vertices)
    shape = render(mesh, size=easel.size, direction=OBLIQUE, title="construction")
    title = f"height: {z.min():.1f} to {z.max():.1f} (it was 0 to {easel.vertices[:, 2].max():.1f})"
    height = render(mesh, size=easel.size, field=z, field_label="z", title=title)
    return [shape, height]


def _restoration(easel: Easel) -> Pictures:
    """Draw the errors on the left; on the right, one above the other, the worst visible place in close-up."""
    record = easel.record(RestorationStage)
    before, after = easel.raised(easel.record(ConstructionStage).z), easel.raised(record.z)
    largest = float(record.order_error.max(initial=0.0))
    error = render(
        easel.mesh(before),
        size=easel.size,
        field=record.order_error if largest > STILL else None,
        field_range=(0.0, largest),
        colormap="heat",
        field_label="order error",
        title=f"{'' if largest > STILL else 'no '}depth order errors, "
        f"{int(record.solved.sum())} vertices solved again",
    )
    worst = int(np.argmax(record.order_error * record.solved * easel.record(VisibilityStage).visible))
    bounds = _close_up(before, worst) if np.any(record.solved) else _bounds(before, after)
    half = (easel.size[1] - _GAP) // 2
    pair = [
        render(easel.mesh(surface), size=size, direction=_NEAR_FRONT, bounds=bounds, title=title)
        for surface, size, title in (
            (before, (easel.size[0], half), "before, at the worst visible place"),
            (after, (easel.size[0], easel.size[1] - half - _GAP), "after"),
        )
    ]
    strip = np.full((_GAP, easel.size[0], 3), 255, dtype=np.uint8)
    return [error, np.concatenate([pair[0], strip, pair[1]])]


def _order(easel: Easel) -> Pictures:
    """Draw the surface before on the left, and after, with what was corrected in colour, on the right."""
    record = easel.record(OrderStage)
    restored = easel.record(RestorationStage).z
    before, after = easel.raised(restored), easel.raised(record.z)
    moved = record.z - restored
    largest = float(np.abs(moved).max())
    if largest <= STILL:
        asked = bool(record.counts)  # of an order that was looked at
        titles = (
            "before",
            "in order: nothing had to be moved" if asked else "order not asked for: unchanged",
        )
        return _pair(easel, (before, before), titles, direction=_FRONT, plate=True)
    bounds = _bounds(before, after)
    count = record.counts.get("pairs_corrected", 0)
    return [
        render(easel.mesh(before), size=easel.size, plate=True, bounds=bounds, title="before"),
        render(
            easel.mesh(after),
            size=easel.size,
            plate=True,
            bounds=bounds,
            field=moved,
            field_range=(-largest, largest),
            colormap="diverging",
            field_label="moved",
            title=f"in order: {count} pairs kept apart",
        ),
    ]


def _compression(easel: Easel) -> Pictures:
    record = easel.record(CompressionStage)
    before, after = easel.raised(easel.record(OrderStage).z), easel.raised(record.z)
    titles = (
        f"compression, before: depth {before[:, 2].max():.1f}",
        f"after: depth {record.z.max():.1f}",
    )
    return _pair(easel, (before, after), titles, direction=SIDE, plate=True)


def _bounded(easel: Easel) -> Pictures:
    """Draw how much each place counts on the left, and how far it has moved on the right."""
    record = easel.record(BoundedStage)
    faces = easel.record(SceneStage).faces
    corners = np.bincount(faces.ravel(), minlength=len(record.z))
    weight = np.bincount(faces.ravel(), np.repeat(record.face_weight, 3), len(record.z)) / np.maximum(
        corners, 1
    )
    counted = render(
        easel.mesh(easel.vertices),
        size=easel.size,
        field=weight,
        field_label="weight",
        title="how much a change counts",
    )
    moved = record.z - easel.vertices[:, 2]
    after = easel.raised(np.maximum(record.z, 0.0))
    still = np.ptp(moved) <= STILL
    title = f"bounded: depth {np.ptp(easel.vertices[:, 2]):.1f} before, {record.z.max():.1f} after"
    result = render(
        easel.mesh(after),
        size=easel.size,
        direction=OBLIQUE,
        plate=True,
        field=None if still else moved,
        field_label="moved",
        title=f"{title}, shape unchanged" if still else title,
    )
    return [counted, result]


def _trim(easel: Easel) -> Pictures:
    easel.record(TrimStage)
    mesh = easel.relief
    if mesh is None:
        mesh = easel.mesh(easel.raised(final_heights(easel.stages)))
    return [
        render(mesh, size=easel.size, plate=True, title="the relief"),
        render(mesh, size=easel.size, direction=OBLIQUE, plate=True, title="from the side"),
    ]


PANELS: Mapping[str, Callable[[Easel], Pictures]] = {
    "scene": SCENE_PANELS["scene"],
    "perspective": _perspective,
    "visibility": SCENE_PANELS["visibility"],
    "clusters": SCENE_PANELS["clusters"],
    "attenuation": SCENE_PANELS["attenuation"],
    "construction": _construction,
    "restoration": _restoration,
    "order": _order,
    "compression": _compression,
    "bounded": _bounded,
    "trim": _trim,
}
"""What draws each stage, in the order of the stages."""
