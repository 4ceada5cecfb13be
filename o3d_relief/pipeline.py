"""The stages in their order: from an Open3D mesh to a high relief."""

from __future__ import annotations

import numpy as np
import open3d as o3d
import scipy.sparse as sp
from numpy.typing import NDArray

from o3d_relief.attenuation_step import attenuation_step
from o3d_relief.bounded_step import bounded_step
from o3d_relief.bounds.ahead import Ahead
from o3d_relief.bounds.lines import Lines
from o3d_relief.bounds.near_points import NearPoints
from o3d_relief.bounds.pairs import vertex_pairs
from o3d_relief.errors import MeshError, ParameterError
from o3d_relief.journal import Journal, OnStage
from o3d_relief.linalg.laplacian import cotangent_laplacian
from o3d_relief.memory import memory_kept
from o3d_relief.order_step import order_step
from o3d_relief.output import trimmed_mesh
from o3d_relief.param_checks import given
from o3d_relief.params import ReliefParams, View
from o3d_relief.progress import OnProgress
from o3d_relief.rays import UnitBox
from o3d_relief.records import SceneStage, TrimStage
from o3d_relief.relief import Relief
from o3d_relief.restoration_step import restoration_step
from o3d_relief.scan_params import ScanParams
from o3d_relief.scene.convert import mesh_arrays
from o3d_relief.scene.scan import Scan, scan_points
from o3d_relief.steps import (
    clusters_step,
    compression_step,
    construction_step,
    frame_step,
    perspective_step,
    scene_step,
    visibility_step,
    visible_depth,
)
from o3d_relief.threads import one_beside
from o3d_relief.trim_step import trim_step, turned_to_viewer

__all__ = ["make_relief"]


@memory_kept()
def make_relief(
    mesh: o3d.geometry.TriangleMesh | o3d.geometry.PointCloud | Scan,
    params: ReliefParams | None = None,
    *,
    view: View | None = None,
    scan: ScanParams | None = None,
    on_stage: OnStage | None = None,
    on_progress: OnProgress | None = None,
    max_triangles: int | None = None,
) -> Relief:
    """Make a high relief of a scene.

    Implements Arpa, Süsstrunk, Hersch, "High Reliefs from 3D Scenes", Computer Graphics Forum 2015, with
    the decisions that NOTATION.md lists.

    Parameters
    ----------
    mesh : open3d.geometry.TriangleMesh, open3d.geometry.PointCloud or Scan
        The scene; never modified. A point cloud is meshed first; a `Scan` is what `scan_points` made of one.
    params : ReliefParams, optional
    view : View, optional
        Where the scene faces; by default z is towards the viewer and y up.
    scan : ScanParams, optional
        How a point cloud is meshed.
    on_stage : callable, optional
        Called with each stage's record as soon as the stage is done.
    on_progress : callable, optional
        Called with the name of the stage and the share of it that is done, None where that is not known: when
        a stage begins and ends, and in every round of long ones. It must be quick. Where it returns False, or
        raises, the work ends.
    max_triangles : int, optional
        Larger meshes are refused; 10,000,000 where omitted.

    Returns
    -------
    Relief

    Raises
    ------
    MeshError
        A mesh from which no relief can be made, or too large a one.
    ParameterError
        A parameter that does not fit the scene.
    SolverError
        A linear system that could not be solved.
    Cancelled
        `on_progress` returned False.

    Examples
    --------
    >>> relief = make_relief(o3d.geometry.TriangleMesh.create_sphere(), ReliefParams(k=4))
    >>> list(relief.stages)[:3]
    ['scene', 'perspective', 'visibility']
    """
    params, view = given("params", params, ReliefParams), given("view", view, View)
    mesh, scanned = _meshed(mesh, scan, view, on_stage, on_progress)
    journal = Journal(on_stage, None if scanned is None else scanned.stages, on_progress)

    journal.begin("scene")
    in_vertices, in_faces = mesh_arrays(mesh, max_triangles)
    frame = frame_step(in_vertices, in_faces, view)
    scene = journal.keep(scene_step(in_vertices, in_faces, frame, params))
    journal.begin("perspective")
    vertices = journal.keep(perspective_step(scene.vertices, view)).vertices
    z, visible, laplacian = _raised(vertices, scene, params, view, journal)

    journal.begin("trim")
    out_faces, turned = turned_to_viewer(in_faces, scene, vertices, visible, laplacian)
    trimmed = trim_step(in_vertices, out_faces, frame, scene, vertices, z)
    if len(trimmed.faces) == 0:
        raise MeshError("Nothing of the scene is left in front of the relief plane.")
    relief_mesh, attributes_mended = trimmed_mesh(mesh, trimmed, frame.unit)
    journal.keep(
        TrimStage(
            counts={
                "vertices": len(trimmed.vertices),
                "faces": len(trimmed.faces),
                "faces_cut": trimmed.faces_cut,
                "faces_dropped": trimmed.faces_dropped,
                "cut_vertices": int((trimmed.source_index < 0).sum()),
                "faces_turned": turned,
                "attributes_mended": attributes_mended,
            }
        )
    )
    return Relief(
        mesh=relief_mesh,
        to_scene=frame.to_scene,
        source_index=trimmed.source_index,
        stages=journal.stages,
        params=params,
        view=view,
        trimmed=trimmed,
        scan=None if scanned is None else scanned.params,
    )


def _meshed(
    mesh: o3d.geometry.TriangleMesh | o3d.geometry.PointCloud | Scan,
    scan: ScanParams | None,
    view: View,
    on_stage: OnStage | None,
    on_progress: OnProgress | None,
) -> tuple[o3d.geometry.TriangleMesh, Scan | None]:
    """Return the scene as a mesh, and the scan that it is made of, if it is."""
    if isinstance(mesh, o3d.geometry.PointCloud):
        scanned = scan_points(mesh, scan, view=view, on_stage=on_stage, on_progress=on_progress)
        return scanned.mesh, scanned
    if scan is not None:
        raise ParameterError("scan says how a point cloud is meshed, but the scene is a mesh: leave it out.")
    return (mesh.mesh, mesh) if isinstance(mesh, Scan) else (mesh, None)


def _raised(
    vertices: NDArray[np.float64], scene: SceneStage, params: ReliefParams, view: View, journal: Journal
) -> tuple[NDArray[np.float64], NDArray[np.bool_], sp.csr_array]:
    """Find the heights of the relief; return what is visible and the cotangent Laplacian as well."""
    faces = scene.faces
    keeps_order = params.in_order and not params.bounded
    with one_beside() as thread:
        ahead = Ahead(thread, vertices, faces) if keeps_order else None
        journal.begin("visibility")
        # Who keeps the order casts more rays through the scene.
        box = UnitBox(vertices, faces) if keeps_order else None
        visible = journal.keep(visibility_step(vertices, faces, view, box)).visible
        settled = params.settled(visible_depth(vertices, visible) * scene.unit)
        journal.begin("bounded" if params.bounded else "clusters")
        laplacian, slivers = cotangent_laplacian(vertices, faces)
        if params.bounded:
            z = journal.keep(bounded_step(vertices, faces, visible, scene, settled, tick=journal.tick)).z
        else:
            lines = Lines(vertices, faces, box)
            z = _attenuated(vertices, visible, laplacian, slivers, scene, lines, ahead, settled, journal)
    return z, visible, laplacian


def _attenuated(
    vertices: NDArray[np.float64],
    visible: NDArray[np.bool_],
    laplacian: sp.csr_array,
    slivers: int,
    scene: SceneStage,
    lines: Lines,
    ahead: Ahead | None,
    params: ReliefParams,
    journal: Journal,
) -> NDArray[np.float64]:
    """Go through the stages of the mode "attenuation", from the clusters to the compression."""
    faces = scene.faces
    clusters = journal.keep(clusters_step(vertices, params))
    journal.begin("attenuation")
    points = journal.keep(attenuation_step(vertices, visible, scene, clusters, params))
    journal.begin("construction")
    pairs = None
    if ahead is not None:
        pairs = vertex_pairs(lines)
        ahead.stack(lines, pairs, laplacian, fine=params.min_gap > 0.0)
    z = journal.keep(
        construction_step(
            vertices, faces, visible, laplacian, slivers, clusters, points, pairs, tick=journal.tick
        )
    ).z
    journal.begin("restoration")
    around = NearPoints(vertices, faces, visible, points.kept_index)
    restored = journal.keep(
        restoration_step(vertices, visible, laplacian, z, clusters, points, around, params, tick=journal.tick)
    )
    journal.begin("order")
    ordered = order_step(
        vertices,
        faces,
        visible,
        laplacian,
        restored,
        around,
        ahead,
        params,
        scene.unit,
        tick=journal.tick,
    )
    z = journal.keep(ordered).z
    journal.begin("compression")
    return journal.keep(compression_step(z, params, scene.unit)).z
