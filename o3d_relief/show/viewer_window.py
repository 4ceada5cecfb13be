"""The stage viewer's window: Open3D's visualizer with keys, fed with records."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from o3d_relief.errors import DisplayError, FileError
from o3d_relief.params import Triple
from o3d_relief.records import AttenuationStage, SceneStage, StageRecord
from o3d_relief.show.live_mesh import LiveMesh
from o3d_relief.show.render import save_png
from o3d_relief.show.stage_surfaces import CutRelief
from o3d_relief.show.viewer_album import Album
from o3d_relief.show.viewer_camera import look_from
from o3d_relief.show.viewer_marks import Caption, plane_outline, point_balls, point_lines, wireframe
from o3d_relief.show.viewer_state import KEYS, ViewerState, arrived, pressed, shown

__all__ = ["ViewerWindow"]

_LEFT, _RIGHT = 263, 262  # GLFW
_CODES = {"N": (ord("N"), _RIGHT), "P": (ord("P"), _LEFT)}

Tell = Callable[[str], None]


class ViewerWindow:
    """A window that shows one stage at a time. To be used from the main thread only.

    Parameters
    ----------
    tell : callable
        Takes a line: what is shown, the keys, where a picture went.
    viewpoint : three floats, optional
        The point u, in relief units; None: infinitely far.
    colors : (n_in, 3) float64, optional
        sRGB colours of the input vertices.
    title : str
    size : (width, height)
        In pixels.
    visible : bool
        False draws into memory only.

    Attributes
    ----------
    state : ViewerState

    Raises
    ------
    DisplayError
        The window cannot be opened.
    """

    def __init__(
        self,
        tell: Tell,
        *,
        viewpoint: Triple | None = None,
        colors: NDArray[np.float64] | None = None,
        title: str = "o3d-relief",
        size: tuple[int, int] = (1200, 900),
        visible: bool = True,
    ) -> None:
        self.state = ViewerState()
        self._tell, self._viewpoint = tell, viewpoint
        self._album = Album(colors)
        self._live: LiveMesh | None = None
        self._cut: LiveMesh | None = None
        self._caption: Caption | None = None
        self._there: dict[str, Any] = {}  # the geometries in the window, by what they are
        self._drawn: tuple[Any, ...] = ()
        self._said = ""
        self._open = True
        self._window = o3d.visualization.VisualizerWithKeyCallback()
        if not self._window.create_window(title, size[0], size[1], visible=visible):
            raise DisplayError("Open3D cannot open its window: the graphics driver lacks OpenGL 3.3.")
        options = self._window.get_render_option()
        options.mesh_show_back_face = True
        options.mesh_shade_option = o3d.visualization.MeshShadeOption.Color
        options.background_color = np.array([0.87, 0.87, 0.865])
        self._register_keys()

    def take(self, message: StageRecord | CutRelief) -> None:
        """Take up a stage or the finished relief."""
        if isinstance(message, CutRelief):
            self.finish(message)
        else:
            self.add(message)

    def add(self, record: StageRecord) -> None:
        """Take up a stage; it is shown at once to who looks at the newest one."""
        if not self._album.add(record):
            self._tell(f"{record.name}: a step of the meshing, drawn by --stages only")
            return
        if isinstance(record, SceneStage):
            if self._album.foreign_colors:
                self._tell("the colours of the input are not shown: they are those of another mesh")
            self._furnish(record)
        self.state = arrived(self.state, self._album.run)
        self._draw()

    def finish(self, cut: CutRelief) -> None:
        """Take up the finished relief, which the stage of the cut then shows."""
        self._album.finish(cut)
        self._cut = LiveMesh(cut.vertices, cut.faces, cut.normals)
        self._drawn = ()
        self._draw()

    def step(self) -> bool:
        """Answer to the keys and the mouse; draw what has changed.

        Returns
        -------
        bool
            False once the window is closed.
        """
        if self._open and self.state.moving:
            self._draw()
        self._open = self._open and bool(self._window.poll_events())
        return self._open

    def close(self) -> None:
        """Close the window and let the graphics driver go."""
        self._open = False
        self._window.destroy_window()

    def picture(self) -> NDArray[np.uint8]:
        """Return what the window shows, (height, width, 3)."""
        image = np.asarray(self._window.capture_screen_float_buffer(True))
        return np.asarray(np.rint(255.0 * image), dtype=np.uint8)

    def press(self, key: str) -> None:
        """Do what a key does.

        Parameters
        ----------
        key : str
            One of those of `pressed`, or "V", "S", "H", "Q".
        """
        if key == "H":
            self._tell("\n".join(f"{name:>10}  {text}" for name, text in KEYS.items()))
        elif key == "Q":
            self._window.close()
        elif key == "V":
            self._look()
        elif key == "S":
            self._save()
        else:
            self.state = pressed(self.state, key, time.monotonic(), self._album.run)
            self._draw()

    def _register_keys(self) -> None:
        def answer(key: str, _window: object) -> bool:
            self.press(key)
            return False  # what has changed is updated already

        for key in "NPCMBOAVSHQ0123456789":
            for code in _CODES.get(key, (ord(key),)):
                self._window.register_key_callback(code, partial(answer, key))

    def _furnish(self, scene: SceneStage) -> None:
        self._live = LiveMesh(scene.vertices, scene.faces)
        bounds = np.array([scene.vertices.min(axis=0), scene.vertices.max(axis=0)])
        self._caption = Caption(bounds)
        self._put("surface", self._live.mesh)
        self._put("plane", plane_outline(bounds))
        self._put("caption", self._caption.mesh)
        self._window.reset_view_point(True)
        self._look()

    def _draw(self) -> None:
        """Bring the window up to the state: move and paint in place what differs from the last time."""
        album, surfaces = self._album, self._album.surfaces
        start, end, share, self.state = shown(self.state, time.monotonic(), album.run)
        if self._live is None or end < 0:
            return
        meaning = album.meaning(self.state)
        looks = (start, end, share, meaning, self.state.points, self.state.wireframe, len(album.run.names))
        if looks != self._drawn:
            surface = surfaces.surface(end)
            if share < 1.0:
                surface = surfaces.surface(start) + share * (surface - surfaces.surface(start))
            painted = album.painted(meaning, end)
            if self._cut is not None and surfaces.cut is not None and surfaces.is_cut(end) and share == 1.0:
                self._cut.paint(painted.colors[surfaces.cut.welded])
                self._put("surface", self._cut.mesh)
            else:
                self._live.move(surface)
                self._live.paint(painted.colors)
                self._put("surface", self._live.mesh)
            self._mark(surface)
            if self._caption is not None:
                self._caption.say(f"{album.title(end)}  ({meaning})", painted.legend)
                self._put("caption", self._caption.mesh)
            self._drawn = looks
            self._window.update_renderer()
        self._say()

    def _mark(self, surface: NDArray[np.float64]) -> None:
        """Show or hide the attenuation points and the wireframe."""
        surfaces, names = self._album.surfaces, self._album.run.names
        record = surfaces.records.get(AttenuationStage.name)
        balls = lines = wires = None
        if self.state.points and isinstance(record, AttenuationStage):
            balls = point_balls(record, surface)
            scene = surfaces.surface(names.index(AttenuationStage.name))
            lines = self._there.get("lines") or point_lines(record, scene)
        if self.state.wireframe:
            wires = self._there.get("wireframe") or wireframe(surfaces.surface(0), surfaces.faces)
        for name, geometry in (("balls", balls), ("lines", lines), ("wireframe", wires)):
            self._put(name, geometry)

    def _put(self, name: str, geometry: Any) -> None:
        """Show a geometry in place of the one of that name; the camera stays where it is."""
        old = self._there.get(name)
        if old is geometry:
            if geometry is not None and name in ("surface", "caption"):
                self._window.update_geometry(geometry)
            return
        if old is not None:
            self._window.remove_geometry(old, reset_bounding_box=False)
        if geometry is not None:
            self._window.add_geometry(geometry, reset_bounding_box=False)
        self._there[name] = geometry

    def _say(self) -> None:
        """Tell what is shown, once, and what the last key had to tell."""
        words = self._album.words(self.state)
        if words != self._said:
            self._tell(words)
        self._said = words
        if self.state.note:
            self._tell(self.state.note)

    def _look(self) -> None:
        """Go to the viewpoint."""
        if self._live is None:
            return
        places = [
            self._there["surface"].vertices,
            self._there["plane"].points,
            self._there["caption"].vertices,
        ]
        corners = np.concatenate([np.asarray(place) for place in places])
        look_from(self._window, self._viewpoint, np.array([corners.min(axis=0), corners.max(axis=0)]))
        self._window.update_renderer()

    def _save(self) -> None:
        """Save what is shown in a new file of the working folder."""
        name = self._album.run.names[self.state.stage] if self._album.run.names else "empty"
        number = 1
        while (path := Path(f"o3d-relief-{name}-{number}.png")).exists():
            number += 1
        try:
            save_png(path, self.picture())
        except FileError as error:
            self._tell(str(error))
        else:
            self._tell(f"saved {path}")
