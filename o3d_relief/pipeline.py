"""The stages in their order: from an Open3D mesh to a high relief."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from types import MappingProxyType
from typing import Any, TypeVar, cast

import numpy as np
import open3d as o3d
import scipy.sparse as sp
from numpy.typing import NDArray

from o3d_relief.errors import MeshError, ParameterError
from o3d_relief.linalg.laplacian import cotangent_laplacian
from o3d_relief.params import ReliefParams, Triple, View
from o3d_relief.records import (
    AttenuationStage,
    ClustersStage,
    CompressionStage,
    ConstructionStage,
    PerspectiveStage,
    RestorationStage,
    SceneStage,
    StageRecord,
    TrimStage,
    VisibilityStage,
)
from o3d_relief.scene.convert import mesh_arrays, trimmed_mesh
from o3d_relief.scene.frame import Frame, relief_frame, to_relief_units
from o3d_relief.scene.weld import weld
from o3d_relief.stages.attenuation import (
    actions,
    differentials,
    nearest_neighbours,
    new_heights,
    relative_differentials,
    select_points,
)
from o3d_relief.stages.clustering import cluster_vertices
from o3d_relief.stages.compression import alpha_for_depth, compress
from o3d_relief.stages.construction import construct
from o3d_relief.stages.perspective import forced_perspective
from o3d_relief.stages.restoration import (
    cluster_radii,
    lifting_discs,
    order_errors,
    restore,
    smoothing_discs,
)
from o3d_relief.stages.trim import Trimmed, trim_behind
from o3d_relief.stages.visibility import visible_vertices

__all__ = ["Relief", "make_relief"]

_ON_PLANE = 1e-9
"""Heights within this of S, in relief units, lie on it: rounding errors leave no slivers at the cut."""

OnStage = Callable[[StageRecord], None]
_Record = TypeVar("_Record", bound=StageRecord)


@dataclass(frozen=True, kw_only=True, eq=False)
class Relief:
    """A high relief and how it came about.

    Attributes
    ----------
    mesh : open3d.geometry.TriangleMesh
        In the relief frame (x right, y up, z towards the viewer, S at z = 0), in the input's unit.
    to_scene : (4, 4) float64
        Takes the relief frame to the input's frame.
    source_index : (n_out,) int64
        Input vertex of each output vertex, -1 for a vertex made by the cut.
    stages : mapping of str to StageRecord
        One record for each stage, in order.
    params : ReliefParams
    view : View
    """

    mesh: o3d.geometry.TriangleMesh
    to_scene: NDArray[np.float64]
    source_index: NDArray[np.int64]
    stages: Mapping[str, StageRecord]
    params: ReliefParams
    view: View

    def report(self) -> dict[str, Any]:
        """Sum the relief up in plain values, for JSON.

        Returns
        -------
        dict
            Parameters and view, the depth of the scene and of the relief (everything and visible vertices
            alone, in the input's unit), the share of the visible vertices that lay behind S before the
            trim, and the time and counts of each stage.
        """
        scene, z = self.stages["scene"], self.stages["compression"].z  # type: ignore[attr-defined]
        visible = self.stages["visibility"].visible  # type: ignore[attr-defined]
        before = scene.vertices[:, 2]  # type: ignore[attr-defined]
        unit = scene.unit  # type: ignore[attr-defined]
        relief_z = np.asarray(self.mesh.vertices)[:, 2]
        return {
            "params": asdict(self.params),
            "view": asdict(self.view),
            "unit": unit,
            "scene_depth": float(np.ptp(before)) * unit,
            "scene_visible_depth": float(np.ptp(before[visible])) * unit,
            "relief_depth": float(relief_z.max()),
            "relief_visible_depth": float(np.ptp(z[visible])) * unit,
            "visible_behind_share": float((z[visible] < -_ON_PLANE).mean()),
            "vertices": len(self.mesh.vertices),
            "triangles": len(self.mesh.triangles),
            "stages": {
                name: {"seconds": record.seconds, "counts": dict(record.counts)}
                for name, record in self.stages.items()
            },
        }


class _Journal:
    """Keeps the records, gives each the time since the one before and tells the caller."""

    def __init__(self, on_stage: OnStage | None) -> None:
        self.stages: dict[str, StageRecord] = {}
        self._on_stage = on_stage
        self._since = time.perf_counter()

    def keep(self, record: _Record) -> _Record:
        timed = replace(record, seconds=time.perf_counter() - self._since)
        self.stages[timed.name] = timed
        if self._on_stage is not None:
            self._on_stage(timed)
        self._since = time.perf_counter()
        return timed


def make_relief(
    mesh: o3d.geometry.TriangleMesh,
    params: ReliefParams | None = None,
    *,
    view: View | None = None,
    on_stage: OnStage | None = None,
) -> Relief:
    """Make a high relief of a scene.

    Implements Arpa, Süsstrunk, Hersch, "High Reliefs from 3D Scenes", Computer Graphics Forum 2015, with
    the decisions that NOTATION.md lists.

    Parameters
    ----------
    mesh : open3d.geometry.TriangleMesh
        The scene; never modified.
    params : ReliefParams, optional
    view : View, optional
        Where the scene faces; by default z is towards the viewer and y up.
    on_stage : callable, optional
        Called with each stage's record as soon as the stage is done.

    Returns
    -------
    Relief

    Raises
    ------
    MeshError
        A mesh from which no relief can be made.
    ParameterError
        A parameter that does not fit the scene.
    SolverError
        A linear system that could not be solved.

    Examples
    --------
    >>> relief = make_relief(o3d.geometry.TriangleMesh.create_sphere(), ReliefParams(k=4))
    >>> list(relief.stages)[:3]
    ['scene', 'perspective', 'visibility']
    """
    params = params or ReliefParams()
    view = view or View()
    journal = _Journal(on_stage)

    in_vertices, in_faces = mesh_arrays(mesh)
    frame = _frame(in_vertices, in_faces, view)
    scene = journal.keep(_scene(in_vertices, in_faces, frame, params))
    vertices = journal.keep(_perspective(scene.vertices, view)).vertices
    visible = journal.keep(_visibility(vertices, scene.faces, view)).visible
    clusters = journal.keep(_clusters(vertices, params))
    points = journal.keep(_attenuation(vertices, visible, clusters, params))
    laplacian, slivers = cotangent_laplacian(vertices, scene.faces)
    z = journal.keep(_construction(vertices, visible, laplacian, slivers, points)).z
    z = journal.keep(_restoration(vertices, visible, laplacian, z, clusters, points, params)).z
    z = journal.keep(_compression(z, params, scene.unit)).z

    trimmed = _trim(in_vertices, in_faces, frame, scene, vertices, z)
    if len(trimmed.faces) == 0:
        raise MeshError("Nothing of the scene is left in front of the relief plane.")
    relief_mesh = trimmed_mesh(mesh, trimmed)
    journal.keep(
        TrimStage(
            counts={
                "vertices": len(trimmed.vertices),
                "faces": len(trimmed.faces),
                "faces_cut": trimmed.faces_cut,
                "faces_dropped": trimmed.faces_dropped,
                "cut_vertices": int((trimmed.source_index < 0).sum()),
            }
        )
    )
    return Relief(
        mesh=relief_mesh,
        to_scene=frame.to_scene,
        source_index=trimmed.source_index,
        stages=MappingProxyType(journal.stages),
        params=params,
        view=view,
    )


def _frame(vertices: NDArray[np.float64], faces: NDArray[np.int64], view: View) -> Frame:
    used = np.zeros(len(vertices), dtype=bool)
    used[faces] = True
    front, up = cast(Triple, view.front), cast(Triple, view.up)  # View has checked and converted both
    frame = relief_frame(vertices[used], front, up)
    # Vertices that no face uses may be anything, infinite even: they take no part.
    vertices[~used] = frame.origin
    return frame


def _scene(
    in_vertices: NDArray[np.float64], in_faces: NDArray[np.int64], frame: Frame, params: ReliefParams
) -> SceneStage:
    welded = weld(to_relief_units(in_vertices, frame, on_grid=True), in_faces)
    if len(welded.faces) == 0:
        raise MeshError(f"None of the {len(in_faces)} triangles of the mesh has three different corners.")
    if params.k > len(welded.vertices):
        raise ParameterError(
            f"k must be at most the number of vertices, {len(welded.vertices)} after welding. "
            f"Got {params.k} instead."
        )
    return SceneStage(
        vertices=welded.vertices,
        faces=welded.faces,
        welded_index=welded.index,
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


def _perspective(vertices: NDArray[np.float64], view: View) -> PerspectiveStage:
    if view.vanishing_point is None:
        return PerspectiveStage(vertices=vertices)
    plane = None if view.viewpoint is None else view.viewpoint[2]
    return PerspectiveStage(vertices=forced_perspective(vertices, view.vanishing_point, view_plane=plane))


def _visibility(vertices: NDArray[np.float64], faces: NDArray[np.int64], view: View) -> VisibilityStage:
    visible = visible_vertices(vertices, faces, viewpoint=view.viewpoint)
    if not visible.any():
        raise MeshError("No vertex of the scene is visible from the viewpoint.")
    return VisibilityStage(visible=visible, counts={"visible": int(visible.sum())})


def _clusters(vertices: NDArray[np.float64], params: ReliefParams) -> ClustersStage:
    labels, centers = cluster_vertices(vertices[:, :2], params.k, seed=params.seed)
    return ClustersStage(
        labels=labels,
        centers=centers,
        counts={"clusters": len(centers), "fewer_than_k": params.k - len(centers)},
    )


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


def _attenuation(
    vertices: NDArray[np.float64], visible: NDArray[np.bool_], clusters: ClustersStage, params: ReliefParams
) -> AttenuationStage:
    index, cluster = select_points(vertices, visible, clusters.labels, clusters.centers)
    height = vertices[index, 2]
    differential = differentials(height, nearest_neighbours(vertices[index, :2], symmetric=False))
    rho = relative_differentials(differential)
    beta = _beta_of_points(params, cluster)
    action = actions(rho, discard_above=params.discard_above, attach_below=params.attach_below)
    settled = new_heights(vertices[index], rho, action, beta)
    return AttenuationStage(
        index=index,
        cluster=cluster,
        height=height,
        differential=differential,
        rho=rho,
        beta=beta,
        action=settled.action,
        new_height=settled.new_height,
        counts={
            "points": len(index),
            "clusters_without_visible_vertex": len(clusters.centers) - len(index),
            "attach": int((settled.action == "attach").sum()),
            "scale": int((settled.action == "scale").sum()),
            "discard": int((settled.action == "discard").sum()),
            "groups_attached": settled.groups_attached,
        },
    )


def _behind(z: NDArray[np.float64], visible: NDArray[np.bool_]) -> int:
    return int((z[visible] < -_ON_PLANE).sum())


def _construction(
    vertices: NDArray[np.float64],
    visible: NDArray[np.bool_],
    laplacian: sp.csr_array,
    slivers: int,
    points: AttenuationStage,
) -> ConstructionStage:
    built = construct(vertices, laplacian, points.kept_index, points.kept_height)
    return ConstructionStage(
        z=built.z,
        counts={
            "fixed_points": len(points.kept_index),
            "slivers_mended": slivers,
            "components": built.components,
            "loose_components": built.loose_components,
            "visible_behind": _behind(built.z, visible),
        },
    )


def _restoration(
    vertices: NDArray[np.float64],
    visible: NDArray[np.bool_],
    laplacian: sp.csr_array,
    z: NDArray[np.float64],
    clusters: ClustersStage,
    points: AttenuationStage,
    params: ReliefParams,
) -> RestorationStage:
    index = points.kept_index
    own_cluster = clusters.labels[index]
    radii = cluster_radii(vertices[:, :2], clusters.labels, len(clusters.centers))[own_cluster]
    error = order_errors(vertices, z, index, radii)
    high = error >= params.max_order_error
    counts = {"high_errors": int(high.sum())}
    if params.smooth_points:
        high |= smoothing_discs(vertices, index, radii)
    if params.in_front:
        high |= lifting_discs(vertices, z, visible)
    bounded = visible if params.in_front else None
    restored = restore(vertices, laplacian, z, high, index, blend=params.blend, in_front=bounded)
    counts |= {
        "solved": int(restored.solved.sum()),
        "points_held": restored.points_held,
        "set_on_plane": restored.set_on_plane,
        "visible_behind": _behind(restored.z, visible),
    }
    return RestorationStage(order_error=error, solved=restored.solved, z=restored.z, counts=counts)


def _compression(z: NDArray[np.float64], params: ReliefParams, unit: float) -> CompressionStage:
    alpha, lowest = params.alpha, params.alpha_min
    counts = {}
    if params.depth is not None:
        alpha = alpha_for_depth(z, params.depth / unit)
        lowest = None if lowest is None else min(lowest, alpha)
        # What is shallow enough already is left alone.
        counts["already_shallower"] = int(alpha == 1.0)
        lowest = 1.0 if alpha == 1.0 else lowest
    if alpha is None and lowest is None:
        return CompressionStage(alpha=np.ones(len(z)), z=z, counts=counts)
    ratio, compressed = compress(z, alpha=1.0 if alpha is None else alpha, alpha_min=lowest)
    return CompressionStage(alpha=ratio, z=compressed, counts=counts)


def _trim(
    in_vertices: NDArray[np.float64],
    in_faces: NDArray[np.int64],
    frame: Frame,
    scene: SceneStage,
    vertices: NDArray[np.float64],
    z: NDArray[np.float64],
) -> Trimmed:
    """Move every input vertex as its welded vertex moved, and cut at S; the result is in the input's unit."""
    usable = scene.welded_index >= 0
    welded = scene.welded_index[usable]
    moved = to_relief_units(in_vertices, frame)
    moved[usable, :2] += (vertices - scene.vertices)[welded, :2]
    moved[usable, 2] = np.where(np.abs(z) < _ON_PLANE, 0.0, z)[welded]
    return trim_behind(moved * frame.unit, in_faces, usable)
