"""The order of the surfaces as a step of the pipeline."""

from __future__ import annotations

from functools import partial

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from o3d_relief.bounds.ahead import Ahead
from o3d_relief.bounds.near_points import NearPoints
from o3d_relief.bounds.order import keep_order
from o3d_relief.params import ReliefParams
from o3d_relief.progress import Tick, silent
from o3d_relief.records import OrderStage, RestorationStage
from o3d_relief.steps import on_plane, ratios

__all__ = ["order_step"]

_STIFFER = (10.0, 100.0, 1e4)
"""How much stiffer still the surface is at the points than in the restoration: corrections go elsewhere."""


def order_step(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    visible: NDArray[np.bool_],
    laplacian: sp.csr_array,
    restored: RestorationStage,
    around: NearPoints,
    ahead: Ahead | None,
    params: ReliefParams,
    unit: float,
    *,
    tick: Tick = silent,
) -> OrderStage:
    """Keep everything in order along the viewing direction."""
    z = restored.z
    if ahead is None:
        return OrderStage(z=on_plane(z))
    # The compression comes later and shrinks gaps, at most by its smallest ratio.
    ratio, lowest = ratios(z, params, unit)
    min_gap = params.min_gap / unit / (0.95 * lowest if ratio < 1.0 else 1.0)
    ordered_with = partial(
        keep_order,
        vertices,
        faces,
        areas=ahead.areas,
        z=z,
        pairs=ahead.pairs,
        between=ahead.between,
        in_front=visible if params.in_front else None,
        min_gap=min_gap,
        tick=tick,
    )
    if restored.stiffness == 0.0:
        ordered = ordered_with(laplacian=laplacian)
    else:
        for stiffer in _STIFFER:
            form = around.stiffness.added_to(laplacian, restored.stiffness * stiffer)
            ordered = ordered_with(laplacian=form)
            near, elsewhere = around.bends.most(ordered.z)
            if ordered.rounds == 0 or near <= elsewhere:
                break
    counts = {
        "pairs_corrected": ordered.corrected_pairs,
        "rounds": ordered.rounds,
        "left": ordered.left,
        "visible_behind": int((ordered.z[visible] < 0.0).sum()),
    }
    return OrderStage(z=on_plane(ordered.z), counts=counts)
