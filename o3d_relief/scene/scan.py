"""A point cloud becomes a mesh."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import open3d as o3d

from o3d_relief.journal import Journal, OnStage
from o3d_relief.param_checks import given
from o3d_relief.params import View
from o3d_relief.progress import OnProgress
from o3d_relief.records import StageRecord
from o3d_relief.scan.steps import ground_step, normals_step, orientation_step, outliers_step, points_step
from o3d_relief.scan.surface_steps import parts_step, skin_step, surface_step
from o3d_relief.scan_params import ScanParams
from o3d_relief.scene.arrays import MeshArrays, cloud_arrays, to_open3d
from o3d_relief.scene.packed import MeshRecord

__all__ = ["Scan", "mesh_from_points", "scan_points"]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Scan(MeshRecord):
    """The mesh of a point cloud and how it came about.

    It can be pickled, for the same version of this package, and copied.

    Attributes
    ----------
    mesh : open3d.geometry.TriangleMesh
        In the cloud's frame and unit, with colours if the cloud has them.
    stages : mapping of str to StageRecord
        One record for each stage, in order.
    params : ScanParams
    """

    stages: Mapping[str, StageRecord]
    params: ScanParams

    def __repr__(self) -> str:
        return (
            f"<Scan: {len(self.mesh.vertices)} vertices, {len(self.mesh.triangles)} triangles, "
            f"stages {', '.join(self.stages)}>"
        )


def scan_points(
    cloud: o3d.geometry.PointCloud,
    params: ScanParams | None = None,
    *,
    view: View | None = None,
    on_stage: OnStage | None = None,
    on_progress: OnProgress | None = None,
) -> Scan:
    """Mesh a point cloud and keep what each stage found.

    Points are cleaned, normals estimated or checked and turned outwards, a surface is laid through them
    (screened Poisson reconstruction), and what no point supports is cut away: a scan from one side
    stays open.

    Parameters
    ----------
    cloud : open3d.geometry.PointCloud
        Never modified.
    params : ScanParams, optional
    view : View, optional
        Where the scan faces and stands; `front` decides which way a sheet faces whose two sides are alike,
        `up` what is a ground.
    on_stage : callable, optional
        Called with each stage's record as soon as the stage is done.
    on_progress : callable, optional
        Called with the name of the stage and the share of it that is done, None where that is not known.
        Where it returns False, or raises, the work ends.

    Returns
    -------
    Scan

    Raises
    ------
    MeshError
        A cloud from which no surface can be made.
    ParameterError
        A parameter that does not fit.
    Cancelled
        `on_progress` returned False.

    Examples
    --------
    >>> ball = o3d.geometry.TriangleMesh.create_sphere(1.0, 40)
    >>> scan = scan_points(o3d.geometry.PointCloud(ball.vertices))
    >>> list(scan.stages)[:3]
    ['points', 'outliers', 'normals']
    """
    params, view = given("params", params, ScanParams), given("view", view, View)
    journal = Journal(on_stage, on_progress=on_progress)
    journal.begin("points")
    arrays = cloud_arrays(cloud)
    points, work = points_step(arrays, params, view)
    points = journal.keep(points)
    journal.begin("outliers")
    outlier = journal.keep(outliers_step(work, params)).outlier
    journal.begin("normals")
    normals = journal.keep(normals_step(work, points, outlier, arrays, params, tick=journal.tick))
    journal.begin("ground")
    ground = journal.keep(ground_step(work, normals, params, view))
    journal.begin("orientation")
    oriented = journal.keep(orientation_step(work, normals, ground, params, view, tick=journal.tick))
    journal.begin("surface")
    surface = journal.keep(surface_step(work, oriented, params, tick=journal.tick))
    journal.begin("skin")
    skin = journal.keep(skin_step(work, oriented, surface, params))
    journal.begin("parts")
    parts = journal.keep(parts_step(points, oriented, skin, params))
    mesh = to_open3d(MeshArrays(vertices=parts.vertices, faces=parts.faces, colors=parts.colors))
    return Scan(mesh=mesh, stages=journal.stages, params=params)


def mesh_from_points(
    cloud: o3d.geometry.PointCloud, params: ScanParams | None = None, *, view: View | None = None
) -> o3d.geometry.TriangleMesh:
    """Mesh a point cloud.

    As `scan_points`, which also returns the records of the stages.

    Parameters
    ----------
    cloud : open3d.geometry.PointCloud
        Never modified.
    params : ScanParams, optional
    view : View, optional
        Where the scan faces and stands.

    Returns
    -------
    open3d.geometry.TriangleMesh
        In the cloud's frame and unit, open where the scan is open.

    Raises
    ------
    MeshError
        A cloud from which no surface can be made.
    ParameterError
        A parameter that does not fit.

    Examples
    --------
    >>> ball = o3d.geometry.TriangleMesh.create_sphere(1.0, 40)
    >>> mesh_from_points(o3d.geometry.PointCloud(ball.vertices)).is_edge_manifold()
    True
    """
    return scan_points(cloud, params, view=view).mesh
