"""The step of the pipeline that chooses the attenuation points and settles what becomes of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from o3d_relief.errors import ParameterError
from o3d_relief.params import ReliefParams
from o3d_relief.point_edits import PointEdit
from o3d_relief.records import AttenuationStage, ClustersStage, SceneStage
from o3d_relief.stages.attenuation import (
    actions,
    differentials,
    nearest_neighbours,
    new_heights,
    relative_differentials,
    select_points,
)

__all__ = [
    "ChosenPoints",
    "attenuation_step",
    "beta_of_clusters",
    "chosen_points",
    "edited_points",
    "settled_points",
]


@dataclass(frozen=True, kw_only=True, eq=False)
class ChosenPoints:
    """The attenuation points before anything is done to them; all arrays as in `AttenuationStage`."""

    index: NDArray[np.int64]
    cluster: NDArray[np.int64]
    differential: NDArray[np.float64]
    rho: NDArray[np.float64]


def attenuation_step(
    vertices: NDArray[np.float64],
    visible: NDArray[np.bool_],
    scene: SceneStage,
    clusters: ClustersStage,
    params: ReliefParams,
) -> AttenuationStage:
    """Choose the attenuation points and find their new heights."""
    return settled_points(vertices, scene, clusters, chosen_points(vertices, visible, clusters), params)


def chosen_points(
    vertices: NDArray[np.float64], visible: NDArray[np.bool_], clusters: ClustersStage
) -> ChosenPoints:
    """Choose the attenuation points: what depends on the scene and the clusters alone."""
    index, cluster = select_points(vertices, visible, clusters.labels, clusters.centers)
    neighbours = nearest_neighbours(vertices[index, :2], symmetric=False)
    differential = differentials(vertices[index, 2], neighbours)
    rho = relative_differentials(differential)
    return ChosenPoints(index=index, cluster=cluster, differential=differential, rho=rho)


def settled_points(
    vertices: NDArray[np.float64],
    scene: SceneStage,
    clusters: ClustersStage,
    chosen: ChosenPoints,
    params: ReliefParams,
) -> AttenuationStage:
    """Decide what becomes of each point, and find their new heights."""
    action = actions(chosen.rho, discard_above=params.discard_above, attach_below=params.attach_below)
    beta = _beta_of_points(params, chosen.cluster)
    point = edited_points(scene, clusters, chosen, params.point_edits)
    released = np.zeros(len(action), dtype=bool)
    for edit, i in zip(params.point_edits, point, strict=True):
        if i >= 0 and edit.beta is not None:
            beta[i] = edit.beta
        if i >= 0 and edit.action is not None:
            action[i] = edit.action
            released[i] = edit.action == "scale"
    if (action == "discard").all():
        raise ParameterError("point_edits must leave at least one attenuation point that is not discarded.")
    # Where a group of neighbours needs an attached point, one that was released by hand is the last choice.
    settled = new_heights(vertices[chosen.index], chosen.rho + released, action, beta)
    return AttenuationStage(
        index=chosen.index,
        cluster=chosen.cluster,
        height=vertices[chosen.index, 2],
        differential=chosen.differential,
        rho=chosen.rho,
        beta=beta,
        action=settled.action,
        new_height=settled.new_height,
        counts={
            "points": len(chosen.index),
            "clusters_without_visible_vertex": len(clusters.centers) - len(chosen.index),
            "attach": int((settled.action == "attach").sum()),
            "scale": int((settled.action == "scale").sum()),
            "discard": int((settled.action == "discard").sum()),
            "groups_attached": settled.groups_attached,
            "edits": int((point >= 0).sum()),
            "edits_without_point": int((point < 0).sum()),
        },
    )


def edited_points(
    scene: SceneStage, clusters: ClustersStage, chosen: ChosenPoints, edits: Sequence[PointEdit]
) -> NDArray[np.int64]:
    """Return the point that each edit concerns, -1 where no vertex of its cluster is visible."""
    vertex = np.array([edit.vertex for edit in edits], dtype=np.int64)
    count = len(scene.welded_index)
    for wrong in vertex[vertex >= count]:
        raise ParameterError(f"An edit's vertex must be one of the mesh's {count}. Got {wrong} instead.")
    welded = scene.welded_index[vertex]
    for wrong in vertex[welded < 0]:
        raise ParameterError(f"An edit's vertex must belong to a triangle. Got {wrong}, which does not.")
    point_of_cluster = np.full(len(clusters.centers), -1, dtype=np.int64)
    point_of_cluster[chosen.cluster] = np.arange(len(chosen.cluster))
    return np.asarray(point_of_cluster[clusters.labels[welded]])


def _beta_of_points(params: ReliefParams, cluster: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return the attenuation factor of each point; a sequence counts by points or by clusters."""
    if isinstance(params.beta, float | int):
        return np.full(len(cluster), float(params.beta))
    beta = np.array(params.beta, dtype=np.float64)
    if len(beta) == params.k:
        return np.asarray(beta[cluster])
    if len(beta) == len(cluster):
        return beta
    raise ParameterError(
        f"beta must be one number or one for each of the {len(cluster)} attenuation points. "
        f"Got {len(beta)} numbers instead."
    )


def beta_of_clusters(points: AttenuationStage, clusters: int) -> NDArray[np.float64]:
    """Return the attenuation factor of each cluster; one without a point takes the median."""
    beta = np.full(clusters, float(np.median(points.beta)))
    beta[points.cluster] = points.beta
    return beta
