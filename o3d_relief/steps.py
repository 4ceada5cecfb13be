"""One step of the pipeline each: takes what the steps before have found, returns its record."""

from __future__ import annotations

from typing import cast

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from o3d_relief.attenuation_step import beta_of_clusters
from o3d_relief.bounds.pairs import Pairs
from o3d_relief.bounds.parts import tie_parts
from o3d_relief.errors import MeshError, ParameterError
from o3d_relief.params import ReliefParams, Triple, View
from o3d_relief.progress import Tick, silent
from o3d_relief.rays import UnitBox
from o3d_relief.records import (
    AttenuationStage,
    ClustersStage,
    CompressionStage,
    ConstructionStage,
    PerspectiveStage,
    SceneStage,
    VisibilityStage,
)
from o3d_relief.scene.frame import RELIEF_UNITS, Frame, relief_frame, to_relief_units
from o3d_relief.scene.weld import weld
from o3d_relief.stages.attenuation import attenuate
from o3d_relief.stages.clustering import cluster_vertices
from o3d_relief.stages.compression import alpha_for_depth, compress
from o3d_relief.stages.construction import construct
from o3d_relief.stages.perspective import forced_perspective
from o3d_relief.stages.visibility import visible_vertices

__all__ = [
    "check_k",
    "clusters_step",
    "compression_step",
    "construction_step",
    "frame_step",
    "on_plane",
    "perspective_step",
    "ratios",
    "scene_step",
    "visibility_step",
    "visible_depth",
]

_OUT_OF_SHAPE = 1e3
"""A forced perspective that makes the scene larger or smaller by more than this leaves nothing of it."""

_ON_PLANE = 1e-9
"""Heights within this of S, in relief units, lie on it: rounding errors leave no slivers at the cut."""


def frame_step(vertices: NDArray[np.float64], faces: NDArray[np.int64], view: View) -> Frame:
    """Find the relief frame from the vertices that faces use."""
    used = np.zeros(len(vertices), dtype=bool)
    used[faces] = True
    front, up = cast(Triple, view.front), cast(Triple, view.up)  # View has checked and converted both
    frame = relief_frame(vertices[used], front, up)
    # Vertices that no face uses may be anything, infinite even: they take no part.
    vertices[~used] = frame.origin
    return frame


def scene_step(
    in_vertices: NDArray[np.float64], in_faces: NDArray[np.int64], frame: Frame, params: ReliefParams
) -> SceneStage:
    """Bring the scene into the relief frame and weld it."""
    welded = weld(to_relief_units(in_vertices, frame, on_grid=True), in_faces)
    if len(welded.faces) == 0:
        raise MeshError(f"None of the {len(in_faces)} triangles of the mesh has three different corners.")
    if not params.bounded:
        check_k(params, len(welded.vertices))
    return SceneStage(
        vertices=welded.vertices,
        faces=welded.faces,
        welded_index=welded.index,
        welded_face=welded.face_index,
        unit=frame.unit,
        counts={
            "input_vertices": len(in_vertices),
            "input_faces": len(in_faces),
            "vertices": len(welded.vertices),
            "faces": len(welded.faces),
            "merged_vertices": welded.merged_vertices,
            "unreferenced_vertices": welded.unreferenced_vertices,
            "degenerate_faces": welded.degenerate_faces,
            "duplicate_faces": welded.duplicate_faces,
        },
    )


def check_k(params: ReliefParams, vertices: int) -> None:
    """Check that there are enough vertices for the clusters."""
    if params.k > vertices:
        raise ParameterError(
            f"k must be at most the number of vertices, {vertices} after welding. "
            f"Got {params.k} instead: give a smaller k."
        )


def perspective_step(vertices: NDArray[np.float64], view: View) -> PerspectiveStage:
    """Draw the scene towards the vanishing point, if there is one."""
    if view.vanishing_point is None:
        return PerspectiveStage(vertices=vertices)
    plane = None if view.viewpoint is None else view.viewpoint[2]
    drawn = forced_perspective(vertices, view.vanishing_point, view_plane=plane)
    extent = float(np.ptp(drawn[:, :2], axis=0).max())
    if not RELIEF_UNITS / _OUT_OF_SHAPE <= extent <= RELIEF_UNITS * _OUT_OF_SHAPE:
        raise ParameterError(
            f"vanishing_point must leave the scene its shape: it would be {extent:.2g} relief units large. "
            f"Got {view.vanishing_point} instead: choose one further behind, or a viewpoint closer by."
        )
    return PerspectiveStage(vertices=drawn)


def visibility_step(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], view: View, box: UnitBox | None = None
) -> VisibilityStage:
    """Find what the viewpoint sees."""
    visible = visible_vertices(vertices, faces, viewpoint=view.viewpoint, box=box)
    if not visible.any():
        raise MeshError("No vertex of the scene is visible from the viewpoint.")
    return VisibilityStage(visible=visible, counts={"visible": int(visible.sum())})


def visible_depth(vertices: NDArray[np.float64], visible: NDArray[np.bool_]) -> float:
    """Return the depth of what is visible."""
    return float(np.ptp(vertices[visible, 2]))


def clusters_step(vertices: NDArray[np.float64], params: ReliefParams) -> ClustersStage:
    """Partition the vertices on x and y."""
    labels, centers = cluster_vertices(vertices[:, :2], params.k, seed=params.seed)
    return ClustersStage(
        labels=labels,
        centers=centers,
        counts={"clusters": len(centers), "fewer_than_k": params.k - len(centers)},
    )


def _behind(z: NDArray[np.float64], visible: NDArray[np.bool_]) -> int:
    return int((z[visible] < 0.0).sum())


def construction_step(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    visible: NDArray[np.bool_],
    laplacian: sp.csr_array,
    slivers: int,
    clusters: ClustersStage,
    points: AttenuationStage,
    pairs: Pairs | None,
    *,
    tick: Tick = silent,
) -> ConstructionStage:
    """Rebuild the surface around the points, with its loose parts tied to the rest."""
    ties = None
    if pairs is not None:
        beta = beta_of_clusters(points, len(clusters.centers))[clusters.labels[pairs.upper[:, 0]]]
        shrink = attenuate(pairs.gap, beta)
        ties = tie_parts(vertices, faces, laplacian, points.kept_index, pairs, shrink)
    built = construct(
        vertices,
        laplacian,
        points.kept_index,
        points.kept_height,
        among_held=None if ties is None else (ties.among_held, ties.among_held_pull),
        to_loose=None if ties is None else (ties.to_loose, ties.to_loose_pull),
        tick=tick,
    )
    counts = {
        "fixed_points": len(points.kept_index),
        "slivers_mended": slivers,
        "components": built.components,
        "loose_components": built.loose_components,
        "visible_behind": _behind(built.z, visible),
    }
    if ties is not None:
        counts |= {
            "ties_across_gaps": ties.across_gaps,
            "ties_in_contact": ties.in_contact,
            "ties_to_nearest": ties.to_nearest,
        }
    return ConstructionStage(z=built.z, counts=counts)


def on_plane(z: NDArray[np.float64]) -> NDArray[np.float64]:
    """Set onto S what lies within rounding errors of it."""
    return np.where(np.abs(z) < _ON_PLANE, 0.0, z)


def ratios(z: NDArray[np.float64], params: ReliefParams, unit: float) -> tuple[float, float]:
    """Return the largest and the smallest compression ratio, 1 and 1 for no compression."""
    alpha, lowest = params.alpha, params.alpha_min
    if params.depth is not None:
        alpha = alpha_for_depth(z, cast(float, params.depth) / unit)
        if alpha == 1.0:
            return 1.0, 1.0  # what is shallow enough already is left alone
        return alpha, alpha / 2.0 if lowest is None else min(lowest, alpha)
    if alpha is None:
        return 1.0, 1.0 if lowest is None else lowest
    return alpha, alpha / 2.0 if lowest is None else lowest


def compression_step(z: NDArray[np.float64], params: ReliefParams, unit: float) -> CompressionStage:
    """Compress the range, to the depth that was asked for."""
    largest, smallest = ratios(z, params, unit)
    counts = {} if params.depth is None else {"already_shallower": int(largest == 1.0)}
    if smallest == 1.0:
        return CompressionStage(alpha=np.ones(len(z)), z=z, counts=counts)
    ratio, compressed = compress(z, alpha=largest, alpha_min=smallest)
    return CompressionStage(alpha=ratio, z=compressed, counts=counts)
