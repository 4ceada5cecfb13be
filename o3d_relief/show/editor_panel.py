"""The sliders and buttons of the live editor."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from open3d.visualization import gui

from o3d_relief.params import ReliefParams
from o3d_relief.show.editor_asks import MODES, Scale, mode_of, mode_values
from o3d_relief.show.sight import Sight, Work
from o3d_relief.show.studio import Studio

__all__ = ["EditorPanel"]

_LIMITS = {
    "k": (1.0, 512.0),
    "beta": (0.0, 1.0),
    "alpha": (0.05, 1.0),
    "discard_above": (0.0, 1.0),
    "attach_below": (0.0, 1.0),
}
_LABELS = {
    "k": "k, attenuation points",
    "beta": "beta, attenuation factor",
    "alpha": "alpha, compression (1: none)",
    "discard_above": "t1: discard above",
    "attach_below": "t2: attach below",
}


class EditorPanel:
    """A column of widgets that ask a studio for changes.

    Parameters
    ----------
    studio : Studio
    em : float
        Height of a letter, in pixels.
    size_mm : float
        Length of the larger side of the relief, in millimetres.
    chosen : callable
        Returns the numbers of the points that are chosen.
    on_tool : callable
        Takes whether the brush is in hand, and its radius in relief units.
    on_file : callable
        Takes "relief", "save" or "load" where a file is to be chosen.

    Attributes
    ----------
    widget : open3d.visualization.gui.Widget
    """

    def __init__(
        self,
        studio: Studio,
        em: float,
        size_mm: float,
        *,
        chosen: Callable[[], Sequence[int]],
        on_tool: Callable[[bool, float], None],
        on_file: Callable[[str], None],
    ) -> None:
        self._studio, self._size_mm, self._chosen = studio, size_mm, chosen
        self._on_tool, self._on_file = on_tool, on_file
        self._sliders: dict[str, Any] = {}
        self._was_set: dict[str, float] = {}
        self._scale: Scale | None = None
        space = round(0.25 * em)
        self.widget = gui.ScrollableVert(space, gui.Margins(round(0.7 * em)))
        self._add_history()
        self._add_parameters()
        self._add_view()
        self._add_points()
        self._add_status()

    # The widgets, from the top down.

    def _add_history(self) -> None:
        studio = self._studio
        self._row(
            ("Undo", studio.undo),
            ("Redo", studio.redo),
            ("Reset", lambda: studio.ask("reset", lambda editor, _: editor.reset())),
        )
        self._row(("Save relief", lambda: self._on_file("relief")))
        self._row(("Save parameters", lambda: self._on_file("save")), ("Load", lambda: self._on_file("load")))

    def _add_parameters(self) -> None:
        for name, text in _LABELS.items():
            kind = gui.Slider.INT if name == "k" else gui.Slider.DOUBLE
            self._slider(name, text, kind, _LIMITS[name], self._asker(name))
        self._mode = gui.Combobox()
        for text in MODES.values():
            self._mode.add_item(text)
        self._mode.set_on_selection_changed(lambda _text, _index: self._ask_mode())
        self._labelled("mode", self._mode)
        self._slider("depth", "depth, mm", gui.Slider.DOUBLE, (0.5, 100.0), lambda _value: self._ask_mode())
        self._finishing = gui.Checkbox("restoration and guarantees")
        self._finishing.checked = True
        self._finishing.set_on_checked(lambda on: self._studio.finish(wanted=on))
        self.widget.add_child(self._finishing)

    def _add_view(self) -> None:
        self._vanishing = gui.Checkbox("vanishing point (x, y, z < 0)")
        self._vanishing.set_on_checked(lambda _on: self._ask_vanishing())
        self.widget.add_child(self._vanishing)
        self._vanishing_at = gui.VectorEdit()
        self._vanishing_at.vector_value = [0.0, 0.0, -300.0]
        self._vanishing_at.set_on_value_changed(lambda _value: self._ask_vanishing())
        self.widget.add_child(self._vanishing_at)

    def _add_points(self) -> None:
        self._picked = gui.Label("no point is chosen: click one")
        self.widget.add_child(self._picked)
        self._slider("own", "its own beta", gui.Slider.DOUBLE, _LIMITS["beta"], self._edit_beta)
        self._row(
            ("Attach", lambda: self._edit("attach")),
            ("Release", lambda: self._edit("scale")),
            ("Discard", lambda: self._edit("discard")),
            ("As before", self._clear),
        )
        self._brush = gui.Checkbox("brush: drag over several points")
        self._brush.set_on_checked(lambda _on: self._tell_tool())
        self.widget.add_child(self._brush)
        self._slider("radius", "its radius", gui.Slider.DOUBLE, (1.0, 30.0), lambda _value: self._tell_tool())
        self._set("radius", 8.0)

    def _add_status(self) -> None:
        self._bar = gui.ProgressBar()
        self.widget.add_child(self._bar)
        self._row(("Cancel", self._studio.cancel))
        self._doing = gui.Label("")
        self._sentence = gui.Label("")
        self._sentence.text_color = gui.Color(0.95, 0.45, 0.35)
        self.widget.add_child(self._doing)
        self.widget.add_child(self._sentence)

    def _row(self, *buttons: tuple[str, Callable[[], None]]) -> None:
        row = gui.Horiz(4)
        for text, act in buttons:
            button = gui.Button(text)
            button.horizontal_padding_em, button.vertical_padding_em = 0.4, 0.05
            button.set_on_clicked(act)
            row.add_child(button)
        self.widget.add_child(row)

    def _labelled(self, text: str, widget: Any) -> None:
        self.widget.add_child(gui.Label(text))
        self.widget.add_child(widget)

    def _slider(
        self, name: str, text: str, kind: Any, limits: tuple[float, float], act: Callable[[float], None]
    ) -> None:
        def moved(value: float) -> None:
            # Open3D tells of values that the program has set, too: rounded to 32 bits they are others.
            if self._scale is None and name != "radius":  # nothing is shown yet
                return
            if abs(value - self._was_set.get(name, math.inf)) > 1e-6 * max(1.0, abs(value)):
                self._was_set.pop(name, None)
                act(round(value, 4))

        slider = gui.Slider(kind)
        slider.set_limits(*limits)
        slider.set_on_value_changed(moved)
        self._sliders[name] = slider
        self._labelled(text, slider)

    # What they ask for.

    def _asker(self, name: str) -> Callable[[float], None]:
        def ask(value: float) -> None:
            wanted: Any = round(value) if name == "k" else value
            if name == "alpha" and value >= 1.0:
                wanted = None
            self._studio.change(name, slow=name == "k", **{name: wanted})

        return ask

    def _ask_mode(self) -> None:
        if self._scale is None:
            return
        mode = list(MODES)[self._mode.selected_index]
        depth = self._scale.to_input(self._sliders["depth"].double_value)
        self._studio.change(
            "mode", slow=True, **mode_values(mode, depth, self._sliders["alpha"].double_value)
        )

    def _ask_vanishing(self) -> None:
        point = tuple(float(c) for c in self._vanishing_at.vector_value) if self._vanishing.checked else None

        def act(editor: Any, continued: bool) -> None:
            editor.change(view=replace(editor.view, vanishing_point=point), continued=continued)

        self._studio.ask("view", act, doing="the scene from its new view", delay=0.4)

    def _edit(self, action: str) -> None:
        points = list(self._chosen())
        if points:
            self._studio.ask(f"edit {action}", lambda editor, _: editor.edit(points, action=action))

    def _edit_beta(self, value: float) -> None:
        points = list(self._chosen())
        if points:
            self._studio.ask(
                f"beta of {points}",
                lambda editor, continued: editor.edit(points, beta=value, continued=continued),
            )

    def _clear(self) -> None:
        points = list(self._chosen())
        if points:
            self._studio.ask("clear", lambda editor, _: editor.clear(points))

    def _tell_tool(self) -> None:
        self._on_tool(self._brush.checked, self._sliders["radius"].double_value)

    # What they show.

    def show(self, sight: Sight) -> None:
        """Set everything to the parameters of a surface."""
        params = sight.params
        self._scale = Scale(unit=sight.unit, size_mm=self._size_mm)
        self._set("k", params.k)
        self._set(
            "beta", params.beta if isinstance(params.beta, float) else sum(params.beta) / len(params.beta)
        )
        self._set("alpha", 1.0 if params.alpha is None else params.alpha)
        self._set("discard_above", params.discard_above)
        self._set("attach_below", params.attach_below)
        self._mode.selected_index = list(MODES).index(mode_of(params))
        deepest = max(float(sight.scene_depth), 1e-9)
        self._sliders["depth"].set_limits(0.02 * self._scale.to_mm(deepest), self._scale.to_mm(deepest))
        depth = deepest if params.depth is None else params.depth
        self._set("depth", self._scale.to_mm(depth))
        self._enable(params)
        self._vanishing.checked = sight.view.vanishing_point is not None
        if sight.view.vanishing_point is not None:
            self._vanishing_at.vector_value = list(sight.view.vanishing_point)

    def show_choice(self, sight: Sight, chosen: Sequence[int]) -> None:
        """Show which points are chosen."""
        if not chosen:
            self._picked.text = "no point is chosen: click one"
            return
        actions = sorted({str(sight.points.action[number]) for number in chosen})
        what = f"point {chosen[0]}" if len(chosen) == 1 else f"{len(chosen)} points"
        self._picked.text = f"{what}: {', '.join(actions)}"
        self._set("own", float(sight.points.beta[chosen[-1]]))

    def show_work(self, work: Work, *, final: bool) -> None:
        """Show what goes on."""
        self._bar.value = 0.0 if not work.doing else (0.05 if work.share is None else work.share)
        share = "" if work.share is None else f", {100.0 * work.share:.0f} %"
        rest = "the finished relief" if final else "a preview"
        self._doing.text = f"computing: {work.doing}{share}" if work.doing else rest
        self._sentence.text = _lines(work.sentence)

    def _enable(self, params: ReliefParams) -> None:
        mode = mode_of(params)
        self._sliders["alpha"].enabled = mode == "alpha"
        self._sliders["depth"].enabled = True
        for name in ("k", "beta", "discard_above", "attach_below"):
            self._sliders[name].enabled = not params.bounded

    def _set(self, name: str, value: float) -> None:
        slider = self._sliders[name]
        self._was_set[name] = value
        if name == "k":
            slider.int_value = round(value)
        else:
            slider.double_value = float(value)

    def ask_file(self, kind: str, path: Path) -> None:
        """Ask for what is to be done with a file that was chosen."""
        if kind == "relief":
            self._studio.save_relief(path)
        elif kind == "save":
            self._studio.save_params(path)
        else:
            self._studio.ask("load", lambda editor, _: editor.load(path), doing="the parameters of the file")


def _lines(text: str, width: int = 40) -> str:
    return "\n".join(textwrap.wrap(text, width))
