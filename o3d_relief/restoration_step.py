"""The restoration as a step of the pipeline: local errors mended, and no pimple left at a point."""

from __future__ import annotations

from functools import partial

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from o3d_relief.bounds.near_points import NearPoints
from o3d_relief.params import ReliefParams
from o3d_relief.progress import Tick, silent
from o3d_relief.records import AttenuationStage, ClustersStage, RestorationStage
from o3d_relief.stages.floor import lowest_heights
from o3d_relief.stages.order_errors import (
    cluster_radii,
    lift_loose,
    lifting_discs,
    order_errors,
    smoothing_discs,
)
from o3d_relief.stages.restoration import restore

__all__ = ["restoration_step"]

_KEPT_ON_PLANE = 0.2
"""Share of its height above its surroundings that what is visible keeps where it would be pressed onto S."""

_STIFFNESS = (3.0, 15.0, 75.0, 375.0)
"""How much stiffer the surface is at a point, as little as is enough."""

_ROOM = 0.9
"""Share of the bends elsewhere that those near the points may have: the order, later, adds to them."""


def restoration_step(
    vertices: NDArray[np.float64],
    visible: NDArray[np.bool_],
    laplacian: sp.csr_array,
    z: NDArray[np.float64],
    clusters: ClustersStage,
    points: AttenuationStage,
    around: NearPoints,
    params: ReliefParams,
    *,
    tick: Tick = silent,
) -> RestorationStage:
    """Find order errors and pimples, and what is visible behind S, and mend them."""
    _, label = connected_components(laplacian, directed=False)
    index = points.kept_index
    if params.in_front:
        z = lift_loose(z, label, index, visible)
    own_cluster = clusters.labels[index]
    radii = cluster_radii(vertices[:, :2], clusters.labels, len(clusters.centers))[own_cluster]
    error = order_errors(vertices, z, index, radii)
    high = error >= params.max_order_error
    counts = {"high_errors": int(high.sum())}
    if params.smooth_points:
        high |= smoothing_discs(vertices, index, radii)
    if params.in_front:
        high |= lifting_discs(vertices, z, label, visible)
    floor = lowest_heights(vertices, visible, share=_KEPT_ON_PLANE) if params.in_front else None
    again = partial(restore, vertices, blend=params.blend, floor=floor, tick=tick)
    stiffness = 0.0
    if not params.smooth_points:
        restored = again(laplacian, z, high, index, label)
    else:
        for stiffness in _STIFFNESS:
            form = around.stiffness.added_to(laplacian, stiffness)
            restored = again(form, z, high, index, label)
            near, elsewhere = around.bends.most(restored.z)
            if near <= _ROOM * elsewhere:
                break
            high = high | around.stiffness.within  # large faces reach further than the discs
    counts |= {
        "solved": int(restored.solved.sum()),
        "points_held": restored.points_held,
        "set_on_floor": restored.set_on_floor,
        "rounds": restored.rounds,
        "visible_behind": int((restored.z[visible] < 0.0).sum()),
    }
    return RestorationStage(
        order_error=error, solved=restored.solved, z=restored.z, stiffness=stiffness, counts=counts
    )
