"""What would be refused, before the long work."""

from __future__ import annotations

import numpy as np
import open3d as o3d

from o3d_relief.attenuation_step import attenuation_step
from o3d_relief.bounded_step import check_bounded
from o3d_relief.params import ReliefParams, View
from o3d_relief.scene.convert import mesh_arrays
from o3d_relief.solid.sizes import check_extents
from o3d_relief.steps import (
    clusters_step,
    frame_step,
    on_plane,
    perspective_step,
    scene_step,
    visibility_step,
    visible_depth,
)

__all__ = ["check_scene"]


def check_scene(
    mesh: o3d.geometry.TriangleMesh,
    params: ReliefParams,
    view: View,
    max_triangles: int | None = None,
    *,
    solid: bool = False,
) -> None:
    """Refuse what `make_relief` would refuse before its long work: go through its stages up to there.

    Parameters
    ----------
    mesh : open3d.geometry.TriangleMesh
        Never modified.
    params : ReliefParams
    view : View
    max_triangles : int, optional
    solid : bool
        Whether it is to become a solid: in the bounded mode, what is seen must then have a depth.

    Raises
    ------
    MeshError
        A mesh from which no relief, or no solid, can be made, or too large a one.
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
        lowest = check_bounded(vertices, visible, scene, settled)
        if solid:
            check_extents(np.column_stack([vertices[:, :2], on_plane(vertices[:, 2] - lowest)]))
    else:
        attenuation_step(vertices, visible, scene, clusters_step(vertices, params), params)
