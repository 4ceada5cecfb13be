"""What the editor keeps between changes: the scene, and the responses to its attenuation points."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import cast

import numpy as np
import open3d as o3d
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from o3d_relief.attenuation_step import beta_of_clusters, chosen_points, edited_points, settled_points
from o3d_relief.bounds.lines import Lines
from o3d_relief.bounds.pairs import vertex_pairs
from o3d_relief.bounds.parts import PartSprings, find_springs
from o3d_relief.linalg.laplacian import cotangent_laplacian
from o3d_relief.live_construction import LiveConstruction
from o3d_relief.params import ReliefParams, View
from o3d_relief.point_edits import PointEdit
from o3d_relief.progress import NOBODY, Progress
from o3d_relief.rays import UnitBox
from o3d_relief.records import AttenuationStage
from o3d_relief.scene.convert import mesh_arrays
from o3d_relief.stages.attenuation import attenuate
from o3d_relief.steps import (
    check_k,
    clusters_step,
    compression_step,
    frame_step,
    perspective_step,
    scene_step,
    visibility_step,
    visible_depth,
)

__all__ = ["LivePoints", "LiveScene"]


class LiveScene:
    """The scene from one view: what no other parameter changes.

    Parameters
    ----------
    mesh : open3d.geometry.TriangleMesh
    params : ReliefParams
    view : View
    progress : Progress
        Told of the stages; may call the work off.

    Raises
    ------
    MeshError, ParameterError
        As `make_relief`.
    """

    def __init__(
        self,
        mesh: o3d.geometry.TriangleMesh,
        params: ReliefParams,
        view: View,
        progress: Progress = NOBODY,
    ) -> None:
        progress.begin("scene")
        in_vertices, in_faces = mesh_arrays(mesh)
        self.view = view
        self.frame = frame_step(in_vertices, in_faces, view)
        self.scene = scene_step(in_vertices, in_faces, self.frame, params)
        self.vertices = perspective_step(self.scene.vertices, view).vertices
        progress.begin("visibility")
        self.visible = visibility_step(self.vertices, self.scene.faces, view).visible
        progress.begin("weights")
        self.laplacian, _ = cotangent_laplacian(self.vertices, self.scene.faces)
        self.parts = int(connected_components(self.laplacian, directed=False, return_labels=False))

    @cached_property
    def springs(self) -> PartSprings | None:
        """What ties the parts of the scene; None for one part."""
        if self.parts == 1:
            return None
        faces = self.scene.faces
        # The same rays as in the pipeline: what they meet may hang on the last digit of float32.
        lines = Lines(self.vertices, faces, UnitBox(self.vertices, faces))
        return find_springs(self.vertices, faces, self.laplacian, vertex_pairs(lines))

    @property
    def visible_depth(self) -> float:
        """Depth of what is visible, in the input's unit."""
        return visible_depth(self.vertices, self.visible) * self.scene.unit

    def settled(self, params: ReliefParams) -> ReliefParams:
        """Return the parameters with a length for a depth that is a share."""
        return params.settled(self.visible_depth)

    def scaled(self, params: ReliefParams) -> NDArray[np.float64]:
        """Scale the scene linearly to the depth of the bounded mode, what is visible in front of S.

        Returns
        -------
        (n,) float64
            Heights in relief units.
        """
        z = self.vertices[:, 2] - self.vertices[self.visible, 2].min()
        depth = cast(float, self.settled(params).depth) / self.scene.unit
        return np.asarray(z * min(1.0, depth / z.max()) if z.max() > 0.0 else z)


class LivePoints:
    """The attenuation points of a scene and the responses to them: for one k, one seed, parts tied or not.

    Parameters
    ----------
    scene : LiveScene
    params : ReliefParams
    progress : Progress
        Told of the stages; may call the work off, in `preview`, too.

    Raises
    ------
    ParameterError
        More clusters than vertices.
    SolverError
        A system is singular or not positive definite.
    """

    def __init__(self, scene: LiveScene, params: ReliefParams, progress: Progress = NOBODY) -> None:
        check_k(params, len(scene.vertices))
        progress.begin("clusters")
        self.scene = scene
        self._key = self._needs(params)
        self._clusters = clusters_step(scene.vertices, params)
        self._chosen = chosen_points(scene.vertices, scene.visible, self._clusters)
        self._springs = scene.springs if params.in_order else None
        self._construction = LiveConstruction(
            scene.vertices, scene.laplacian, self._chosen.index, self._springs, progress
        )

    def _needs(self, params: ReliefParams) -> tuple[int, int, bool]:
        return params.k, params.seed, params.in_order and self.scene.parts > 1

    def serve(self, scene: LiveScene, params: ReliefParams) -> bool:
        """Tell whether these are the points of a scene with some parameters."""
        return scene is self.scene and self._key == self._needs(params)

    @property
    def index(self) -> NDArray[np.int64]:
        """(p,) int64: the welded vertex of each point."""
        return self._chosen.index

    def edited(self, edits: Sequence[PointEdit]) -> NDArray[np.int64]:
        """Return the number of the point (e,) that each edit concerns, -1 where there is none."""
        return edited_points(self.scene.scene, self._clusters, self._chosen, edits)

    def preview(self, params: ReliefParams) -> tuple[AttenuationStage, NDArray[np.float64]]:
        """Settle the points and find the heights (n,) of the surface after the construction and compression.

        Parameters
        ----------
        params : ReliefParams

        Raises
        ------
        ParameterError
            Parameters that do not fit the scene.
        """
        scene = self.scene
        points = settled_points(scene.vertices, scene.scene, self._clusters, self._chosen, params)
        shrink = None
        if self._springs is not None:
            stacked = self._springs.stacked
            beta = beta_of_clusters(points, len(self._clusters.centers))
            shrink = attenuate(stacked.gap, beta[self._clusters.labels[stacked.upper[:, 0]]])
        z = self._construction.heights(points.action != "discard", points.new_height, shrink)
        return points, np.array(compression_step(z, scene.settled(params), scene.scene.unit).z)
