"""The live editor's window: Open3D's gui as a thin layer over a studio."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import open3d as o3d
from open3d.visualization import gui

from o3d_relief.params import ReliefParams, View
from o3d_relief.show.editor_panel import EditorPanel
from o3d_relief.show.editor_scene import EditorScene, nearest_point, points_within
from o3d_relief.show.studio import Studio

__all__ = ["EditorWindow"]

_PANEL_EMS = 21.0
_CLICK = 4  # pixels that a click may move
_DRAW_EVERY = 0.25  # seconds
_FRESH = 1.5  # seconds for which something new is drawn again and again


class EditorWindow:
    """The window of the live editor. To be used from the main thread only, once in a process.

    Parameters
    ----------
    mesh : open3d.geometry.TriangleMesh
    params : ReliefParams
    view : View
    output : Path, optional
        Where "Save relief" writes to, without asking.
    size_mm : float
        Length of the relief's larger side in millimetres.
    title : str
    size : (width, height)
        Of the window, in pixels.

    Attributes
    ----------
    studio : Studio
    chosen : list of int
        The attenuation points that are chosen.
    """

    def __init__(
        self,
        mesh: o3d.geometry.TriangleMesh,
        params: ReliefParams,
        view: View,
        *,
        output: Path | None = None,
        size_mm: float = 150.0,
        title: str = "o3d-relief edit",
        size: tuple[int, int] = (1280, 860),
    ) -> None:
        self._application = gui.Application.instance
        self._application.initialize()
        self._window = self._application.create_window(title, *size)
        self._output = output
        self.chosen: list[int] = []
        self._brush, self._radius = False, 8.0
        self._control = False
        self._pressed: tuple[int, int] | None = None
        self._version = -1
        self._synced = False
        self._said = ""
        self._scene = EditorScene(self._window.renderer)
        self._scene.widget.set_on_mouse(self._mouse)
        self._news, self._leaving = True, False
        self._fresh = self._drawn = 0.0
        self.studio = Studio(mesh, params, view, self._note)
        self._panel = EditorPanel(
            self.studio,
            self._window.theme.font_size,
            size_mm,
            chosen=lambda: self.chosen,
            on_tool=self._take_tool,
            on_file=self._choose_file,
        )
        self._window.add_child(self._scene.widget)
        self._window.add_child(self._panel.widget)
        self._window.set_on_layout(self._layout)
        self._window.set_on_close(self._close)
        self._window.set_on_tick_event(self._tick)
        self._window.set_on_key(self._key)
        self._result: tuple[ReliefParams, View] | None = None

    def run(self) -> tuple[ReliefParams, View] | None:
        """Answer to the user until the window is closed.

        Returns
        -------
        params, view
            The last ones; None where the editor could not be opened.
        """
        self._application.run()
        return self._result

    def quit(self) -> None:
        """Close the window soon; may be called from any thread."""
        self._leaving = True

    def _note(self) -> None:
        """Take note, on the studio's thread, that there are news."""
        self._news = True

    def _tick(self) -> bool:
        """Show the news, if there are any; tell whether to draw.

        Open3D loses what is posted to it before it runs, and frames that a slow driver has no time for: so it
        looks for news here, and draws again now and then.
        """
        now = time.monotonic()
        if self._leaving:
            self._leaving = False
            # Not at once: Open3D goes on with the window whose tick this is.
            self._application.post_to_main_thread(self._window, self._window.close)
        if self._news:
            self._news, self._fresh = False, now
            self._show()
        if now - self._drawn < _DRAW_EVERY:
            return False
        self._drawn = now
        if now - self._fresh < _FRESH:
            self._scene.widget.force_redraw()
        return True

    def _show(self) -> None:
        sight, work = self.studio.sight, self.studio.work
        if work.failed and sight is None:
            self.quit()
            return
        if sight is not None and sight.version != self._version:
            self._version = sight.version
            self.chosen = [number for number in self.chosen if number < len(sight.points.vertex)]
            self._scene.show(sight, self.chosen)
            self._synced = False
        if work.sentence != self._said:  # a slider that has asked too much goes back
            self._said, self._synced = work.sentence, False
        if sight is not None and not self._synced and not self.studio.waiting:
            self._panel.show(sight)  # not in the middle of a drag
            self._panel.show_choice(sight, self.chosen)
            self._synced = True
        self._panel.show_work(work, final=sight is not None and sight.final)
        self._window.set_needs_layout()
        self._window.post_redraw()

    def _layout(self, _context: Any) -> None:
        area = self._window.content_rect
        width = round(_PANEL_EMS * self._window.theme.font_size)
        self._scene.widget.frame = gui.Rect(area.x, area.y, area.width - width, area.height)
        self._panel.widget.frame = gui.Rect(area.get_right() - width, area.y, width, area.height)

    def _close(self) -> bool:
        self._result = self.studio.close()
        return True

    def _key(self, event: Any) -> bool:
        """Undo, redo and close by the keys that do it everywhere."""
        names = gui.KeyName
        if event.type == gui.KeyEvent.Type.DOWN and event.key in (names.LEFT_CONTROL, names.RIGHT_CONTROL):
            self._control = True
        elif event.type == gui.KeyEvent.Type.UP and event.key in (names.LEFT_CONTROL, names.RIGHT_CONTROL):
            self._control = False
        elif event.type == gui.KeyEvent.Type.DOWN and self._control and event.key in (names.Z, names.Y):
            if event.key == names.Z:
                self.studio.undo()
            else:
                self.studio.redo()
        elif event.type == gui.KeyEvent.Type.DOWN and self._control and event.key == names.Q:
            self._window.close()
        else:
            return False
        return True

    # The mouse.

    def _mouse(self, event: Any) -> Any:
        """Choose points: the one that is clicked, or those under the brush."""
        kinds, results = gui.MouseEvent.Type, gui.Widget.EventCallbackResult
        frame = self._scene.widget.frame
        x, y = event.x - frame.x, event.y - frame.y
        left = event.type in (kinds.BUTTON_DOWN, kinds.DRAG, kinds.BUTTON_UP)
        if self._brush and left:
            if event.type == kinds.BUTTON_DOWN:
                self.chosen = []
            self._brush_at(x, y)
            return results.CONSUMED
        if event.type == kinds.BUTTON_DOWN:
            self._pressed = (x, y)
        elif event.type == kinds.BUTTON_UP and self._pressed is not None:
            moved = max(abs(x - self._pressed[0]), abs(y - self._pressed[1]))
            if moved <= _CLICK:
                self._click(x, y, add=event.is_modifier_down(gui.KeyModifier.CTRL))
            self._pressed = None
        return results.IGNORED

    def _click(self, x: int, y: int, *, add: bool) -> None:
        sight = self.studio.sight
        if sight is None:
            return
        number = self._scene.ball_under(x, y, sight)
        place = self._scene.place_under(x, y) if number is None else None
        if place is not None:
            number = nearest_point(place, sight.points, sight.unit)
        if number is None:
            self.chosen = []
        else:
            self.chosen = [*self.chosen, number] if add and number not in self.chosen else [number]
        self._choose()

    def _brush_at(self, x: int, y: int) -> None:
        sight, place = self.studio.sight, self._scene.place_under(x, y)
        if sight is None or place is None:
            return
        under = points_within(place, sight.points, sight.unit, self._radius)
        more = [number for number in under if number not in self.chosen]
        if more:
            self.chosen = [*self.chosen, *more]
            self._choose()

    def _choose(self) -> None:
        sight = self.studio.sight
        if sight is not None:
            self._scene.mark(sight, self.chosen)
            self._panel.show_choice(sight, self.chosen)
            self._fresh = time.monotonic()
            self._window.post_redraw()

    def _take_tool(self, brush: bool, radius: float) -> None:
        self._brush, self._radius = brush, radius

    # Files.

    def _choose_file(self, kind: str) -> None:
        if kind == "relief" and self._output is not None:
            self._panel.ask_file(kind, self._output)
            return
        mode = gui.FileDialog.OPEN if kind == "load" else gui.FileDialog.SAVE
        dialog = gui.FileDialog(mode, "a file", self._window.theme)
        for ending in (".ply", ".obj", ".stl", ".glb") if kind == "relief" else (".json",):
            dialog.add_filter(ending, ending)

        def done(name: str) -> None:
            self._window.close_dialog()
            self._panel.ask_file(kind, Path(name))

        dialog.set_on_cancel(self._window.close_dialog)
        dialog.set_on_done(done)
        self._window.show_dialog(dialog)
