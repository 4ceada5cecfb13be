"""A column of labelled sliders and rows of buttons."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from open3d.visualization import gui

__all__ = ["Column"]


class Column:
    """A column of widgets that scrolls.

    Parameters
    ----------
    em : float
        Height of a letter, in pixels.

    Attributes
    ----------
    widget : open3d.visualization.gui.Widget
    """

    def __init__(self, em: float) -> None:
        self.widget = gui.ScrollableVert(round(0.25 * em), gui.Margins(round(0.7 * em)))
        self._sliders: dict[str, Any] = {}
        self._was_set: dict[str, float] = {}

    def add(self, widget: Any, text: str = "") -> Any:
        """Add a widget, under a label where there is a text; return it."""
        if text:
            self.widget.add_child(gui.Label(text))
        self.widget.add_child(widget)
        return widget

    def row(self, *buttons: tuple[str, Callable[[], None]]) -> None:
        """Add buttons side by side."""
        row = gui.Horiz(4)
        for text, act in buttons:
            button = gui.Button(text)
            button.horizontal_padding_em, button.vertical_padding_em = 0.4, 0.05
            button.set_on_clicked(act)
            row.add_child(button)
        self.add(row)

    def check(self, text: str, act: Callable[[bool], None], *, on: bool = False) -> Any:
        """Add a check box; return it."""
        box = gui.Checkbox(text)
        box.checked = on
        box.set_on_checked(act)
        return self.add(box)

    def slider(
        self,
        name: str,
        text: str,
        limits: tuple[float, float],
        act: Callable[[float], None],
        *,
        whole: bool = False,
    ) -> None:
        """Add a slider; it acts only once it has been set, and only when it is moved by hand."""

        def moved(value: float) -> None:
            # Open3D tells of values that the program has set, too: rounded to 32 bits they are others.
            was = self._was_set.get(name)
            if was is not None and abs(value - was) > 1e-6 * max(1.0, abs(value)):
                self._was_set[name] = math.inf
                act(round(value, 4))

        slider = gui.Slider(gui.Slider.INT if whole else gui.Slider.DOUBLE)
        slider.set_limits(*limits)
        slider.set_on_value_changed(moved)
        self._sliders[name] = slider
        self.add(slider, text)

    def set(self, name: str, value: float, limits: tuple[float, float] | None = None) -> None:
        """Set a slider."""
        slider = self._sliders[name]
        if limits is not None:
            slider.set_limits(*limits)
        self._was_set[name] = value
        slider.double_value = float(value)

    def value(self, name: str) -> float:
        """Return the value of a slider."""
        return float(self._sliders[name].double_value)

    def enable(self, name: str, *, on: bool) -> None:
        """Let a slider be moved, or not."""
        self._sliders[name].enabled = on
