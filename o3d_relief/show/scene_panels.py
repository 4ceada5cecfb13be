"""The two panels of each stage that leaves the scene as it is: what is found and chosen in it."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import ArrayLike

from o3d_relief.records import AttenuationStage, ClustersStage, SceneStage, VisibilityStage
from o3d_relief.show.colors import label_colors
from o3d_relief.show.easel import OBLIQUE, SIDE, STILL, Easel, Pictures
from o3d_relief.show.render import render

__all__ = ["ACTIONS", "HIDDEN", "SCENE_PANELS", "SEEN"]

SEEN, HIDDEN = (0.93, 0.78, 0.42), (0.33, 0.45, 0.62)
ACTIONS = {"attach": (0.16, 0.47, 0.71), "scale": (0.93, 0.66, 0.16), "discard": (0.78, 0.17, 0.20)}


def _scene(easel: Easel) -> Pictures:
    record = easel.record(SceneStage)
    mesh = easel.mesh(record.vertices)
    title = f"scene: {len(record.vertices)} vertices, {len(record.faces)} faces"
    return [
        render(mesh, size=easel.size, title=title),
        render(mesh, size=easel.size, direction=OBLIQUE, title="from the side"),
    ]


def _visibility(easel: Easel) -> Pictures:
    visible = easel.record(VisibilityStage).visible
    colors = np.where(visible[:, None], SEEN, HIDDEN)
    count = int(visible.sum())
    legend = [(SEEN, f"visible: {count}"), (HIDDEN, f"hidden: {len(visible) - count}")]
    mesh = easel.mesh(easel.vertices)
    return [
        render(mesh, size=easel.size, colors=colors, sharp_colors=True, title="visibility", legend=legend),
        render(
            mesh,
            size=easel.size,
            direction=SIDE,
            colors=colors,
            sharp_colors=True,
            title="from the side",
            legend=legend,
        ),
    ]


def _clusters(easel: Easel) -> Pictures:
    record = easel.record(ClustersStage)
    colors = label_colors(record.labels, easel.record(SceneStage).faces)[record.labels]
    mesh = easel.mesh(easel.vertices)
    points = np.column_stack([record.centers, np.zeros(len(record.centers))])
    title = f"clusters: {len(record.centers)}, with their centres"
    front = render(
        mesh,
        size=easel.size,
        colors=colors,
        sharp_colors=True,
        points=points,
        point_colors=(0.97, 0.96, 0.94),
        point_radius=_dot(easel, len(points)),
        title=title,
    )
    side = render(
        mesh, size=easel.size, direction=OBLIQUE, colors=colors, sharp_colors=True, title="from the side"
    )
    return [front, side]


def _attenuation(easel: Easel) -> Pictures:
    record = easel.record(AttenuationStage)
    mesh = easel.mesh(easel.vertices)
    points = easel.vertices[record.index]
    colors = np.array([ACTIONS[str(action)] for action in record.action]).reshape(-1, 3)
    legend: list[tuple[ArrayLike, str]] = [
        (color, f"{action}: {int(np.sum(record.action == action))}") for action, color in ACTIONS.items()
    ]
    radius = _dot(easel, len(points))
    kept = record.action != "discard"
    top = float(record.new_height[kept].max(initial=0.0))
    old = float(record.height[kept].max(initial=0.0))
    actions = render(
        mesh,
        size=easel.size,
        points=points,
        point_colors=colors,
        point_radius=radius,
        title="attenuation points by action",
        legend=legend,
    )
    heights = render(
        mesh,
        size=easel.size,
        points=points[kept],
        point_field=record.new_height[kept] if top > STILL else None,
        point_colors=None if top > STILL else ACTIONS["attach"],
        point_radius=radius,
        field_range=(0.0, top),
        field_label="new height",
        title=f"new heights: {f'up to {top:.1f}' if top > STILL else 'all 0'}, before up to {old:.1f}",
    )
    return [actions, heights]


def _dot(easel: Easel, count: int) -> float:
    """Return a radius at which so many points stay apart."""
    return float(np.clip(0.08 * min(easel.size) / np.sqrt(max(count, 1)), 1.2, 0.0075 * min(easel.size)))


SCENE_PANELS: Mapping[str, Callable[[Easel], Pictures]] = {
    "scene": _scene,
    "visibility": _visibility,
    "clusters": _clusters,
    "attenuation": _attenuation,
}
"""What draws each of these stages."""
