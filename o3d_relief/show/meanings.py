"""What the colours of a surface can mean in the stage viewer."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from o3d_relief.records import (
    AttenuationStage,
    BoundedStage,
    ClustersStage,
    RestorationStage,
    SceneStage,
    VisibilityStage,
)
from o3d_relief.show.colors import apply_colormap, label_colors
from o3d_relief.show.paint import PLASTER
from o3d_relief.show.scene_panels import ACTIONS, HIDDEN, SEEN
from o3d_relief.show.stage_surfaces import StageSurfaces

__all__ = ["MEANINGS", "Meaning", "Painted", "meanings_of", "own_meaning"]

Color = tuple[float, float, float]
Legend = tuple[tuple[Color, str], ...]
_NONE: Color = (0.62, 0.62, 0.62)


@dataclass(frozen=True, kw_only=True, eq=False)
class Painted:
    """The colours of a surface and what they say.

    Attributes
    ----------
    colors : (n, 3) float64
        sRGB in [0, 1], on the welded vertices.
    legend : tuple of (colour, text)
    """

    colors: NDArray[np.float64]
    legend: Legend = ()


Paint = Callable[[StageSurfaces, int], Painted]


@dataclass(frozen=True, kw_only=True)
class Meaning:
    """One meaning of the colours.

    Attributes
    ----------
    record : str
        The stage that must have been reached for it.
    paint : callable
        Takes the surfaces and the number of a stage, returns what it looks like.
    moves : bool
        Whether that differs from stage to stage.
    """

    record: str
    paint: Paint
    moves: bool = False


def _count(surfaces: StageSurfaces) -> int:
    return len(surfaces.surface(0))


def _shade(surfaces: StageSurfaces, _stage: int) -> Painted:
    return Painted(colors=np.tile(PLASTER, (_count(surfaces), 1)))


def _clusters(surfaces: StageSurfaces, _stage: int) -> Painted:
    record: Any = surfaces.records[ClustersStage.name]
    colors = label_colors(record.labels, surfaces.faces)[record.labels]
    return Painted(colors=colors, legend=((PLASTER, f"{len(record.centers)} clusters"),))


def _visible(surfaces: StageSurfaces, _stage: int) -> Painted:
    record: Any = surfaces.records[VisibilityStage.name]
    count = int(record.visible.sum())
    return Painted(
        colors=np.where(record.visible[:, None], SEEN, HIDDEN),
        legend=((SEEN, f"visible: {count}"), (HIDDEN, f"hidden: {len(record.visible) - count}")),
    )


def _actions(surfaces: StageSurfaces, _stage: int) -> Painted:
    """Paint each cluster by what becomes of its attenuation point."""
    clusters: Any = surfaces.records[ClustersStage.name]
    points: Any = surfaces.records[AttenuationStage.name]
    colors = np.tile(_NONE, (len(clusters.centers), 1))
    for action, color in ACTIONS.items():
        colors[points.cluster[points.action == action]] = color
    legend = tuple(
        (color, f"{action}: {int((points.action == action).sum())}") for action, color in ACTIONS.items()
    )
    return Painted(colors=colors[clusters.labels], legend=legend)


def _order_errors(surfaces: StageSurfaces, _stage: int) -> Painted:
    record: Any = surfaces.records[RestorationStage.name]
    top = max(float(record.order_error.max(initial=0.0)), 1e-9)
    return _field(record.order_error, (0.0, top), "heat", "order error")


def _displacement(surfaces: StageSurfaces, stage: int) -> Painted:
    moved = surfaces.surface(stage)[:, 2] - surfaces.surface(0)[:, 2]
    # One range for all stages, so that they can be compared.
    every = [
        surfaces.surface(number)[:, 2] - surfaces.surface(0)[:, 2] for number in range(len(surfaces.names))
    ]
    largest = max(*(float(np.abs(one).max()) for one in every), 1e-9)
    return _field(moved, (-largest, largest), "diverging", "displacement")


def _weights(surfaces: StageSurfaces, _stage: int) -> Painted:
    """Paint each vertex by the mean weight of its faces."""
    record: Any = surfaces.records[BoundedStage.name]
    corners, count = surfaces.faces.ravel(), _count(surfaces)
    number = np.maximum(np.bincount(corners, minlength=count), 1)
    mean = np.bincount(corners, np.repeat(record.face_weight, 3), count) / number
    return _field(mean, (0.0, max(float(mean.max()), 1e-9)), "viridis", "weight")


def _field(values: NDArray[np.float64], between: tuple[float, float], colormap: str, name: str) -> Painted:
    ends = apply_colormap([between[0], 0.5 * (between[0] + between[1]), between[1]], colormap, between)
    words = (f"{name} {between[0]:.3g}", f"{0.5 * (between[0] + between[1]):.3g}", f"{between[1]:.3g}")
    legend = tuple(
        ((float(r), float(g), float(b)), text) for (r, g, b), text in zip(ends, words, strict=True)
    )
    return Painted(colors=apply_colormap(values, colormap, between), legend=legend)


MEANINGS: Mapping[str, Meaning] = {
    "shade": Meaning(record=SceneStage.name, paint=_shade),
    "cluster": Meaning(record=ClustersStage.name, paint=_clusters),
    "visible": Meaning(record=VisibilityStage.name, paint=_visible),
    "action": Meaning(record=AttenuationStage.name, paint=_actions),
    "order error": Meaning(record=RestorationStage.name, paint=_order_errors),
    "weight": Meaning(record=BoundedStage.name, paint=_weights),
    "displacement": Meaning(record=SceneStage.name, paint=_displacement, moves=True),
}
"""What needs no more than the records; the input's own colours come with the viewer."""

_OWN = {
    VisibilityStage.name: "visible",
    ClustersStage.name: "cluster",
    AttenuationStage.name: "action",
    RestorationStage.name: "order error",
    BoundedStage.name: "weight",
}


def meanings_of(surfaces: StageSurfaces) -> tuple[str, ...]:
    """Return the meanings that the stages so far allow."""
    return tuple(name for name, meaning in MEANINGS.items() if meaning.record in surfaces.records)


def own_meaning(stage: str) -> str:
    """Return the meaning that tells most about a stage."""
    return _OWN.get(stage, "shade")
