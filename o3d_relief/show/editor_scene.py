"""The relief and its attenuation points in the live editor's window, and what the mouse points at."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import open3d as o3d
from numpy.typing import NDArray
from open3d.visualization import gui, rendering

from o3d_relief.editor import EditorPoints
from o3d_relief.show.live_mesh import LiveMesh
from o3d_relief.show.paint import PLASTER
from o3d_relief.show.render import plate_bounds
from o3d_relief.show.scene_panels import ACTIONS
from o3d_relief.show.sight import Sight

__all__ = ["EditorScene", "nearest_point", "points_within"]

_BALL = 1.3  # relief units
_REACH = 9.0  # pixels around the middle of a ball
_FIELD = 30.0  # degrees
_CHOSEN = (1.0, 1.0, 1.0)
_BACKGROUND = [0.87, 0.87, 0.865, 1.0]


class EditorScene:
    """The scene widget.

    Parameters
    ----------
    renderer : open3d.visualization.rendering.Renderer
        Of the window.

    Attributes
    ----------
    widget : open3d.visualization.gui.SceneWidget
    """

    def __init__(self, renderer: Any) -> None:
        self.widget = gui.SceneWidget()
        self.widget.scene = rendering.Open3DScene(renderer)
        self.widget.enable_scene_caching(True)  # a slider that moves does not draw the scene anew
        self.widget.scene.set_background(_BACKGROUND)
        self.widget.scene.show_skybox(False)
        # Light from the upper left, as in the pictures; shadows would cost a software renderer seconds.
        self.widget.scene.set_lighting(
            rendering.Open3DScene.LightingProfile.NO_SHADOWS, np.array([0.55, -0.65, -0.6], dtype=np.float32)
        )
        self.widget.scene.scene.set_indirect_light_intensity(18_000)
        self.widget.scene.scene.set_sun_light([0.55, -0.65, -0.6], [1.0, 0.98, 0.95], 55_000)
        self._clay = _material(PLASTER)
        self._slab = _material((0.55, 0.54, 0.52))
        self._marks = _material((1.0, 1.0, 1.0))
        self._faces: NDArray[np.int64] | None = None
        self._live: LiveMesh | None = None
        self._shown: NDArray[np.float64] = np.zeros((0, 3))
        self._rays: Any = None

    def show(self, sight: Sight, chosen: Sequence[int]) -> None:
        """Show a surface and its points."""
        scene = self.widget.scene
        if self._live is None or sight.faces is not self._faces:
            self._live, self._faces = LiveMesh(sight.vertices, sight.faces), sight.faces
            self._furnish(sight.vertices)
        self._live.move(sight.vertices)
        _replace(scene, "relief", self._live.mesh, self._clay)
        self._shown, self._rays = sight.vertices, None
        self.mark(sight, chosen)

    def mark(self, sight: Sight, chosen: Sequence[int]) -> None:
        """Show the points, those that are chosen in white."""
        balls = _balls(sight.points, sight.unit, chosen)
        _replace(self.widget.scene, "points", balls, self._marks)
        self.widget.force_redraw()

    def front(self) -> None:
        """Look at the relief from the front."""
        low, high = self._shown.min(axis=0), self._shown.max(axis=0)
        middle, (width, height, depth) = (low + high) / 2, high - low
        frame = self.widget.frame
        aspect = frame.width / frame.height if frame.width > 0 and frame.height > 0 else 1.0
        half = np.tan(np.deg2rad(_FIELD / 2.0))
        away = 0.58 * max(height, width / aspect) / half + 0.5 * depth
        box = o3d.geometry.AxisAlignedBoundingBox(low, high)
        self.widget.setup_camera(_FIELD, box, middle.astype(np.float32))
        self.widget.look_at(middle, middle + np.array([0.0, 0.0, away]), np.array([0.0, 1.0, 0.0]))
        self.widget.center_of_rotation = middle

    def place_under(self, x: float, y: float) -> NDArray[np.float64] | None:
        """Return the place (3,) of the relief under a pixel of the widget, None beside it."""
        if self._faces is None:
            return None
        if self._rays is None:
            self._rays = o3d.t.geometry.RaycastingScene()
            self._rays.add_triangles(
                o3d.core.Tensor(self._shown.astype(np.float32)),
                o3d.core.Tensor(self._faces.astype(np.uint32)),
            )
        camera, frame = self.widget.scene.camera, self.widget.frame
        # The depth in the picture gives wrong places in this version of Open3D: a ray is cast instead.
        eye = np.asarray(camera.get_model_matrix())[:3, 3]
        ahead = np.asarray(camera.unproject(x, y, 0.5, frame.width, frame.height))
        ray = np.concatenate([eye, ahead - eye]).astype(np.float32)
        distance = float(self._rays.cast_rays(o3d.core.Tensor(ray[None]))["t_hit"].numpy()[0])
        return eye + distance * (ahead - eye) if np.isfinite(distance) else None

    def ball_under(self, x: float, y: float, sight: Sight) -> int | None:
        """Return the point whose ball lies under a pixel of the widget, None where there is none."""
        if not len(sight.points.vertex):
            return None
        camera, frame = self.widget.scene.camera, self.widget.frame
        to_screen = np.asarray(camera.get_projection_matrix()) @ np.asarray(camera.get_view_matrix())
        places = sight.points.new_position / sight.unit
        seen = np.column_stack([places, np.ones(len(places))]) @ to_screen.T
        seen = seen[:, :2] / seen[:, 3:]
        away = np.hypot(
            (0.5 + 0.5 * seen[:, 0]) * frame.width - x, (0.5 - 0.5 * seen[:, 1]) * frame.height - y
        )
        nearest = int(np.argmin(away))
        return nearest if away[nearest] <= _REACH else None

    def _furnish(self, vertices: NDArray[np.float64]) -> None:
        low, high = plate_bounds([vertices.min(axis=0), vertices.max(axis=0)])
        # Right behind S: what lies behind it is to be cut off.
        slab = o3d.geometry.TriangleMesh.create_box(*(high - low)).translate(low)
        slab.compute_vertex_normals()
        _replace(self.widget.scene, "plate", slab, self._slab)
        if not len(self._shown):
            self._shown = vertices
            self.front()


def nearest_point(place: NDArray[np.float64], points: EditorPoints, unit: float) -> int | None:
    """Return the attenuation point nearest to a place (3,) in relief units, None where there is none.

    Nearest from the front, as the clusters are.
    """
    if not len(points.vertex):
        return None
    return int(np.argmin(np.linalg.norm(points.new_position[:, :2] / unit - place[:2], axis=1)))


def points_within(place: NDArray[np.float64], points: EditorPoints, unit: float, radius: float) -> list[int]:
    """Return the attenuation points under a brush of a radius in relief units, as seen from the front."""
    away = np.linalg.norm(points.new_position[:, :2] / unit - place[:2], axis=1)
    return [int(number) for number in np.flatnonzero(away <= radius)]


def _material(color: Sequence[float]) -> Any:
    material = rendering.MaterialRecord()
    material.shader = "defaultLit"
    material.base_color = [*color, 1.0]
    material.base_roughness = 0.9
    material.base_reflectance = 0.2
    return material


def _replace(scene: Any, name: str, mesh: o3d.geometry.TriangleMesh, material: Any) -> None:
    if scene.has_geometry(name):
        scene.remove_geometry(name)
    if len(mesh.vertices):
        scene.add_geometry(name, mesh, material)


def _balls(points: EditorPoints, unit: float, chosen: Sequence[int]) -> o3d.geometry.TriangleMesh:
    """Return a ball for each point; those that are edited or chosen are larger."""
    ball = o3d.geometry.TriangleMesh.create_sphere(_BALL, 8)
    vertices, faces = np.asarray(ball.vertices), np.asarray(ball.triangles)
    count = len(points.vertex)
    colors = np.array([ACTIONS[str(action)] for action in points.action]).reshape(-1, 3)
    picked = np.isin(np.arange(count), list(chosen))
    colors[picked] = _CHOSEN
    size = np.where(picked, 1.6, np.where(points.edited, 1.35, 1.0))
    places = points.new_position / unit + (0.0, 0.0, 0.5 * _BALL)  # half of it sinks in otherwise
    start = np.arange(count)[:, None, None] * len(vertices)
    mesh = o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector((places[:, None] + size[:, None, None] * vertices).reshape(-1, 3)),
        o3d.utility.Vector3iVector((start + faces[None]).reshape(-1, 3).astype(np.int32)),
    )
    mesh.vertex_colors = o3d.utility.Vector3dVector(np.repeat(colors, len(vertices), axis=0))
    mesh.compute_vertex_normals()
    return mesh
