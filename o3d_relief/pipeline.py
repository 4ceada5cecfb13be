"""The stages in their order: from an Open3D mesh to a high relief."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from o3d_relief.attenuation_step import attenuation_step
from o3d_relief.bounded_step import bounded_step
from o3d_relief.bounds.certificate import Certificate, certify
from o3d_relief.bounds.lines import Lines
from o3d_relief.bounds.near_points import NearPoints
from o3d_relief.errors import MeshError, ParameterError
from o3d_relief.journal import Journal, OnStage
from o3d_relief.linalg.laplacian import cotangent_laplacian
from o3d_relief.order_step import order_step
from o3d_relief.output import trimmed_mesh
from o3d_relief.params import ReliefParams, View
from o3d_relief.progress import OnProgress
from o3d_relief.records import StageRecord, TrimStage, final_heights
from o3d_relief.restoration_step import restoration_step
from o3d_relief.scan_params import ScanParams
from o3d_relief.scene.convert import mesh_arrays
from o3d_relief.scene.scan import Scan, scan_points
from o3d_relief.scene.weld import weld
from o3d_relief.stages.trim import Trimmed
from o3d_relief.steps import (
    clusters_step,
    compression_step,
    construction_step,
    frame_step,
    perspective_step,
    scene_step,
    stacked_pairs,
    trim_step,
    turned_to_viewer,
    visibility_step,
)

__all__ = ["Relief", "make_relief"]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Relief:
    """A high relief and how it came about.

    Attributes
    ----------
    mesh : open3d.geometry.TriangleMesh
        In the relief frame (x right, y up, z towards the viewer, S at z = 0), in the input's unit.
    to_scene : (4, 4) float64
        Takes the relief frame to the input's frame.
    source_index : (n_out,) int64
        Input vertex of each output vertex, -1 for a vertex made by the cut. The input of a point cloud
        is its mesh, of the stage "parts".
    stages : mapping of str to StageRecord
        One record for each stage, in order; for a point cloud, those of its meshing come first.
    params : ReliefParams
    view : View
    certificate : Certificate
        What was tested and what failed; computed when it is first asked for.
    trimmed : Trimmed
        How the cut was made: between which input vertices each output vertex lies, the input face of each
        output face.
    scan : ScanParams or None
        How the point cloud was meshed, if it was one.
    """

    mesh: o3d.geometry.TriangleMesh
    to_scene: NDArray[np.float64]
    source_index: NDArray[np.int64]
    stages: Mapping[str, StageRecord]
    params: ReliefParams
    view: View
    trimmed: Trimmed
    scan: ScanParams | None = None

    def __post_init__(self) -> None:
        self.to_scene.flags.writeable = False
        self.source_index.flags.writeable = False

    def __repr__(self) -> str:
        depth = float(np.asarray(self.mesh.vertices)[:, 2].max())
        return (
            f"<Relief: {len(self.mesh.vertices)} vertices, {len(self.mesh.triangles)} triangles, "
            f"{depth:.4g} deep, stages {', '.join(self.stages)}>"
        )

    def _repr_png_(self) -> bytes:
        """Show the relief in a notebook: a sheet of views."""
        from o3d_relief.show.notebook import relief_png  # drawing is not needed to make a relief

        return relief_png(self)

    @cached_property
    def certificate(self) -> Certificate:
        """Test what the relief keeps of its scene, on its mesh; done when it is first asked for."""
        scene: Any = self.stages["scene"]
        in_z = np.append(scene.vertices[:, 2], 0.0)[scene.welded_index]  # -1, unused, takes the last one
        before = self.trimmed.to_vertices(in_z[:, None])[:, 0]
        welded = weld(self.trimmed.vertices / scene.unit, self.trimmed.faces)
        _, first = np.unique(np.append(-1, welded.index), return_index=True)
        stages: dict[str, Any] = dict(self.stages)
        return certify(
            relief=welded.vertices,
            relief_faces=welded.faces,
            relief_before=before[first[1:] - 1],
            relief_parents=scene.welded_index[self.trimmed.parents[welded.face_from]],
            scene=stages["perspective"].vertices,
            scene_faces=scene.faces,
            heights=final_heights(stages),
            visible=stages["visibility"].visible,
            points=stages["bounded"].attached if self.params.bounded else stages["attenuation"].kept_index,
            min_gap=self.params.min_gap / scene.unit,
        )

    def report(self) -> dict[str, Any]:
        """Sum the relief up in plain values, for JSON.

        Returns
        -------
        dict
            The summary, and the certificate with a sentence for each thing that does not hold.
        """
        certificate = asdict(self.certificate) | {"failures": self.certificate.failures}
        return self.summary() | {"certificate": certificate}

    def summary(self) -> dict[str, Any]:
        """Sum up what is known without further measurement.

        Returns
        -------
        dict
            Parameters and view, the depth of the scene and of the relief (everything and visible vertices
            alone, in the input's unit), the share of the visible vertices that lay behind S before the
            trim, in bounded mode the `energy_gap` of its stage, and the time and counts of each stage.
        """
        stages: dict[str, Any] = dict(self.stages)
        scene, z, visible = stages["scene"], final_heights(stages), stages["visibility"].visible
        before = scene.vertices[:, 2]
        return {
            "params": {name: value for name, value in asdict(self.params).items() if name != "weights"},
            "mode": "bounded" if self.params.bounded else "attenuation",
            "view": asdict(self.view),
            "scan": None if self.scan is None else asdict(self.scan),
            "unit": scene.unit,
            "scene_depth": float(np.ptp(before)) * scene.unit,
            "scene_visible_depth": float(np.ptp(before[visible])) * scene.unit,
            "relief_depth": float(np.asarray(self.mesh.vertices)[:, 2].max()),
            "relief_visible_depth": float(np.ptp(z[visible])) * scene.unit,
            "visible_behind_share": float((z[visible] < 0.0).mean()),
            "energy_gap": getattr(stages.get("bounded"), "energy_gap", None),
            "vertices": len(self.mesh.vertices),
            "triangles": len(self.mesh.triangles),
            "stages": {
                name: {"seconds": record.seconds, "counts": dict(record.counts)}
                for name, record in self.stages.items()
            },
        }


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
    params = ReliefParams() if params is None else params
    view = View() if view is None else view
    for name, value, kind in (("params", params, ReliefParams), ("view", view, View)):
        if not isinstance(value, kind):
            raise ParameterError(f"{name} must be a {kind.__name__}. Got {value!r} instead.")
    scanned = None
    if isinstance(mesh, o3d.geometry.PointCloud):
        scanned = scan_points(mesh, scan, view=view, on_stage=on_stage, on_progress=on_progress)
        mesh = scanned.mesh
    elif scan is None and isinstance(mesh, Scan):
        scanned, mesh = mesh, mesh.mesh
    elif scan is not None:
        raise ParameterError("scan says how a point cloud is meshed, but the scene is a mesh: leave it out.")
    journal = Journal(on_stage, None if scanned is None else scanned.stages, on_progress)

    journal.begin("scene")
    in_vertices, in_faces = mesh_arrays(mesh, max_triangles)
    frame = frame_step(in_vertices, in_faces, view)
    scene = journal.keep(scene_step(in_vertices, in_faces, frame, params))
    faces = scene.faces
    journal.begin("perspective")
    vertices = journal.keep(perspective_step(scene.vertices, view)).vertices
    journal.begin("visibility")
    visible = journal.keep(visibility_step(vertices, faces, view)).visible
    journal.begin("bounded" if params.bounded else "clusters")
    laplacian, slivers = cotangent_laplacian(vertices, faces)
    if params.bounded:
        z = journal.keep(bounded_step(vertices, faces, visible, scene, params, tick=journal.tick)).z
    else:
        clusters = journal.keep(clusters_step(vertices, params))
        journal.begin("attenuation")
        points = journal.keep(attenuation_step(vertices, visible, scene, clusters, params))
        journal.begin("construction")
        lines = Lines(vertices, faces)
        pairs = stacked_pairs(lines, params)
        z = journal.keep(
            construction_step(
                vertices, faces, visible, laplacian, slivers, clusters, points, pairs, tick=journal.tick
            )
        ).z
        journal.begin("restoration")
        around = NearPoints(vertices, faces, visible, points.kept_index)
        restored = journal.keep(
            restoration_step(
                vertices, visible, laplacian, z, clusters, points, around, params, tick=journal.tick
            )
        )
        journal.begin("order")
        ordered = order_step(
            vertices,
            faces,
            visible,
            laplacian,
            restored,
            around,
            lines,
            pairs,
            params,
            scene.unit,
            tick=journal.tick,
        )
        z = journal.keep(ordered).z
        journal.begin("compression")
        z = journal.keep(compression_step(z, params, scene.unit)).z

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
        stages=MappingProxyType(journal.stages),
        params=params,
        view=view,
        trimmed=trimmed,
        scan=None if scanned is None else scanned.params,
    )
