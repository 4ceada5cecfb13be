"""The order of the surfaces as a step of the pipeline."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from o3d_relief.bounds.columns import column_pairs
from o3d_relief.bounds.lines import Lines
from o3d_relief.bounds.near_points import NearPoints
from o3d_relief.bounds.order import Ordered, keep_order
from o3d_relief.bounds.pairs import Pairs, close_pairs
from o3d_relief.bounds.silhouettes import edges_that_turn, silhouette_pairs
from o3d_relief.linalg.laplacian import vertex_areas
from o3d_relief.params import ReliefParams
from o3d_relief.progress import Tick, silent
from o3d_relief.records import OrderStage, RestorationStage
from o3d_relief.steps import on_plane, ratios

__all__ = ["order_step"]

_LINES = 256
"""Lines along x and along y on which the order is kept, besides those through vertices and crossings."""

_STIFFER = (10.0, 100.0)
"""How much stiffer still the surface is at the points than in the restoration: corrections go elsewhere."""


def order_step(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    visible: NDArray[np.bool_],
    laplacian: sp.csr_array,
    restored: RestorationStage,
    around: NearPoints,
    lines: Lines,
    pairs: Pairs | None,
    params: ReliefParams,
    unit: float,
    *,
    tick: Tick = silent,
) -> OrderStage:
    """Keep everything in order along the viewing direction."""
    z = restored.z
    if pairs is None:
        return OrderStage(z=on_plane(z))
    # The compression comes later and shrinks gaps, at most by its smallest ratio.
    ratio, lowest = ratios(z, params, unit)
    min_gap = params.min_gap / unit / (0.95 * lowest if ratio < 1.0 else 1.0)
    turns = edges_that_turn(vertices, faces)
    # For a smallest gap, which need not be least at vertices and silhouettes, the grid is a fine one.
    grid = column_pairs(lines, side=_LINES if min_gap == 0.0 else 4 * _LINES)
    pairs = Pairs.join([pairs, silhouette_pairs(vertices, faces, turns), close_pairs(lines), grid])
    areas = vertex_areas(vertices, faces)
    front = visible if params.in_front else None

    def ordered_with(form: sp.csr_array) -> Ordered:
        return keep_order(
            vertices,
            faces,
            form,
            areas,
            z,
            pairs,
            edges=turns[0],
            in_front=front,
            min_gap=min_gap,
            tick=tick,
        )

    if restored.stiffness == 0.0:
        ordered = ordered_with(laplacian)
    else:
        for stiffer in _STIFFER:
            ordered = ordered_with(around.stiffness.added_to(laplacian, restored.stiffness * stiffer))
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
