"""The sliders and buttons of the live editor."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

from open3d.visualization import gui

from o3d_relief.params import ReliefParams, View
from o3d_relief.show.editor_asks import MODES, Scale, mode_of, mode_values
from o3d_relief.show.editor_column import Column
from o3d_relief.show.sight import Sight, Work
from o3d_relief.show.studio import Studio

__all__ = ["EditorPanel"]

_SLIDERS = {
    "k": ("k, attenuation points", (1.0, 512.0)),
    "beta": ("beta, attenuation factor", (0.0, 1.0)),
    "alpha": ("alpha, compression (1: none)", (0.05, 1.0)),
    "discard_above": ("t1: discard above", (0.0, 1.0)),
    "attach_below": ("t2: attach below", (0.0, 1.0)),
}
_NEWS, _WRONG = gui.Color(0.85, 0.85, 0.85), gui.Color(0.95, 0.45, 0.35)
_RADIUS = 8.0  # of the brush, in relief units


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
        self._scale: Scale | None = None
        self._view: View | None = None
        self._column = Column(em)
        self.widget = self._column.widget
        self._add_history()
        self._add_parameters()
        self._add_view()
        self._add_points()
        self._add_status()

    # The widgets, from the top down.

    def _add_history(self) -> None:
        studio, row = self._studio, self._column.row
        reset = ("Reset", lambda: studio.ask("reset", lambda editor, _: editor.reset()))
        row(("Undo", studio.undo), ("Redo", studio.redo), reset)
        row(("Save relief", lambda: self._on_file("relief")))
        row(("Save parameters", lambda: self._on_file("save")), ("Load", lambda: self._on_file("load")))

    def _add_parameters(self) -> None:
        for name, (text, limits) in _SLIDERS.items():
            self._column.slider(name, text, limits, self._asker(name), whole=name == "k")
        self._mode = gui.Combobox()
        for text in MODES.values():
            self._mode.add_item(text)
        self._mode.set_on_selection_changed(lambda _text, _index: self._ask_mode())
        self._column.add(self._mode, "mode")
        self._column.slider("depth", "depth, mm", (0.5, 100.0), self._ask_depth)
        self._column.check("restoration and guarantees", lambda on: self._studio.finish(wanted=on), on=True)

    def _add_view(self) -> None:
        self._vanishing = self._column.check(
            "vanishing point (x, y, z < 0)", lambda _on: self._ask_vanishing()
        )
        self._vanishing_at = self._column.add(gui.VectorEdit())
        self._vanishing_at.vector_value = [0.0, 0.0, -300.0]
        self._vanishing_at.set_on_value_changed(lambda _value: self._ask_vanishing())

    def _add_points(self) -> None:
        column = self._column
        self._picked = column.add(gui.Label("no point is chosen: click one"))
        column.slider("own", "its own beta", (0.0, 1.0), self._edit_beta)
        column.row(
            ("Attach", lambda: self._edit("attach")),
            ("Release", lambda: self._edit("scale")),
            ("Discard", lambda: self._edit("discard")),
            ("As before", self._clear),
        )
        self._brush = column.check("brush: drag over several points", lambda _on: self._tell_tool())
        column.slider("radius", "its radius", (1.0, 30.0), lambda _value: self._tell_tool())
        column.set("radius", _RADIUS)

    def _add_status(self) -> None:
        self._bar = self._column.add(gui.ProgressBar())
        self._column.row(("Cancel", self._studio.cancel))
        self._doing = self._column.add(gui.Label(""))
        self._sentence = self._column.add(gui.Label(""))

    # What they ask for.

    def _asker(self, name: str) -> Callable[[float], None]:
        def ask(value: float) -> None:
            wanted: Any = round(value) if name == "k" else value
            if name == "alpha" and value >= 1.0:
                wanted = None
            self._studio.change(name, slow=name == "k", **{name: wanted})

        return ask

    def _chosen_mode(self) -> str:
        return list(MODES)[int(self._mode.selected_index)]

    def _ask_depth(self, _value: float) -> None:
        if self._chosen_mode() != "alpha":
            self._ask_mode()

    def _ask_mode(self) -> None:
        if self._scale is not None:
            depth = self._scale.to_input(self._column.value("depth"))
            values = mode_values(self._chosen_mode(), depth, self._column.value("alpha"))
            self._studio.change("mode", slow=True, **values)

    def _ask_vanishing(self) -> None:
        point: Any = None
        if self._vanishing.checked:
            point = tuple(round(float(c), 4) for c in self._vanishing_at.vector_value)
        if self._view is None or point == self._view.vanishing_point:
            return  # set by the program

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
        self._on_tool(self._brush.checked, self._column.value("radius"))

    def ask_file(self, kind: str, path: Path) -> None:
        """Ask for what is to be done with a file that was chosen."""
        if kind == "relief":
            self._studio.save_relief(path)
        elif kind == "save":
            self._studio.save_params(path)
        else:
            self._studio.ask("load", lambda editor, _: editor.load(path), doing="the parameters of the file")

    # What they show.

    def show(self, sight: Sight) -> None:
        """Set everything to the parameters of a surface."""
        params, column = sight.params, self._column
        self._scale, self._view = Scale(unit=sight.unit, size_mm=self._size_mm), sight.view
        beta = params.beta if isinstance(params.beta, float) else sum(params.beta) / len(params.beta)
        column.set("k", params.k)
        column.set("beta", beta)
        column.set("alpha", 1.0 if params.alpha is None else params.alpha)
        column.set("discard_above", params.discard_above)
        column.set("attach_below", params.attach_below)
        self._mode.selected_index = list(MODES).index(mode_of(params))
        deepest = self._scale.to_mm(sight.scene_depth)
        depth = deepest if params.depth is None else self._scale.to_mm(cast(float, params.depth))
        column.set("depth", depth, (0.01 * deepest, max(deepest, depth)))
        self._enable(params)
        point = sight.view.vanishing_point
        self._vanishing.checked = point is not None
        if point is not None:
            self._vanishing_at.vector_value = list(point)

    def _enable(self, params: ReliefParams) -> None:
        self._column.enable("alpha", on=mode_of(params) == "alpha")
        for name in ("k", "beta", "discard_above", "attach_below"):
            self._column.enable(name, on=not params.bounded)

    def show_choice(self, sight: Sight, chosen: Sequence[int]) -> None:
        """Show which points are chosen."""
        if not chosen:
            self._picked.text = "no point is chosen: click one"
            return
        actions = sorted({str(sight.points.action[number]) for number in chosen})
        what = f"point {chosen[0]}" if len(chosen) == 1 else f"{len(chosen)} points"
        self._picked.text = f"{what}: {', '.join(actions)}"
        self._column.set("own", float(sight.points.beta[chosen[-1]]))

    def show_work(self, work: Work, *, final: bool) -> None:
        """Show what goes on."""
        self._bar.value = 0.0 if not work.doing else (0.05 if work.share is None else work.share)
        share = "" if work.share is None else f", {100.0 * work.share:.0f} %"
        rest = "the finished relief" if final else "a preview"
        self._doing.text = f"computing: {work.doing}{share}" if work.doing else rest
        self._sentence.text = "\n".join(textwrap.wrap(work.sentence, 40))
        self._sentence.text_color = _WRONG if work.wrong else _NEWS
