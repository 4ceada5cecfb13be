"""What would be refused, before the long work."""

from __future__ import annotations

import open3d as o3d

from o3d_relief.attenuation_step import attenuation_step
from o3d_relief.bounded_step import check_bounded
from o3d_relief.params import ReliefParams, View
from o3d_relief.scene.convert import mesh_arrays
from o3d_relief.steps import (
    clusters_step,
    frame_step,
    perspective_step,
    scene_step,
    visibility_step,
    visible_depth,
)

__all__ = ["check_scene"]


def check_scene(
    mesh: o3d.geometry.TriangleMesh, params: ReliefParams, view: View, max_triangles: int | None = None
) -> None:
    """Refuse what `make_relief` would refuse: go through its stages up to where the long ones begin.

    Parameters
    ----------
    mesh : open3d.geometry.TriangleMesh
        Never modified.
    params : ReliefParams
    view : View
    max_triangles : int, optional

    Raises
    ------
    MeshError
        A mesh from which no relief can be made, or too large a one.
    ParameterError
        A parameter that does not fit the scene.
    """
    in_vertices, in_faces = mesh_arrays(mesh, max_triangles)
    frame = frame_step(in_vertices, in_faces, view)
    scene = scene_step(in_vertices, in_faces, frame, params)
    vertices = perspective_step(scene.vertices, view).vertices
    visible = visibility_step(vertices, scene.faces, view).visible
    if params.bounded:
        settled = params.settled(visible_depth(vertices, visible) * scene.unit)
        check_bounded(vertices, visible, scene, settled)
    else:
        attenuation_step(vertices, visible, scene, clusters_step(vertices, params), params)
