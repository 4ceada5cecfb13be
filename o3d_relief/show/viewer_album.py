"""What the stage viewer has to show: the stages so far, their colours and their words."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from o3d_relief.records import AttenuationStage, SceneStage, StageRecord
from o3d_relief.show.meanings import MEANINGS, Painted, meanings_of, own_meaning
from o3d_relief.show.paint import PLASTER
from o3d_relief.show.stage_surfaces import CutRelief, StageSurfaces
from o3d_relief.show.viewer_state import OWN, Run, ViewerState

__all__ = ["INPUT_COLORS", "Album"]

INPUT_COLORS = "input colours"


class Album:
    """The stages so far.

    Parameters
    ----------
    colors : (n_in, 3) float64, optional
        sRGB colours of the input vertices.

    Attributes
    ----------
    surfaces : StageSurfaces
    run : Run
        What the keys can lead to.
    """

    def __init__(self, colors: NDArray[np.float64] | None = None) -> None:
        self.surfaces = StageSurfaces()
        self.run = Run()
        self._colors = colors
        self._paints: dict[str, Painted] = {}  # that no later stage changes

    def add(self, record: StageRecord) -> bool:
        """Take up a stage; False for a step of the meshing of a point cloud."""
        if not self.surfaces.add(record):
            return False
        self._renew()
        return True

    def finish(self, cut: CutRelief) -> None:
        """Take up the finished relief."""
        self.surfaces.cut = cut
        self._paints.pop(INPUT_COLORS, None)  # those of the relief are known now
        self._renew()

    @property
    def foreign_colors(self) -> bool:
        """Whether the input's colours are those of a mesh with other vertices."""
        scene: Any = self.surfaces.records.get(SceneStage.name)
        return scene is not None and self._colors is not None and len(self._colors) != len(scene.welded_index)

    def meaning(self, state: ViewerState) -> str:
        """Return what the colours mean, "shade" where the wanted meaning is not known yet."""
        wanted = self.run.own[state.stage] if state.meaning == OWN else state.meaning
        return wanted if wanted in self.run.meanings else "shade"

    def painted(self, meaning: str, stage: int) -> Painted:
        """Return the colours of a stage."""
        if meaning in self._paints:
            return self._paints[meaning]
        colors = self._own_colors() if meaning == INPUT_COLORS else None
        if colors is not None:
            painted = Painted(colors=colors)
        else:
            painted = MEANINGS[meaning].paint(self.surfaces, stage)
        if meaning == INPUT_COLORS or not MEANINGS[meaning].moves:
            self._paints[meaning] = painted
        return painted

    def title(self, stage: int) -> str:
        """Return the number, name and time of a stage."""
        name = self.run.names[stage]
        return f"{stage + 1}/{len(self.run.names)} {name}, {self.surfaces.records[name].seconds:.2f} s"

    def words(self, state: ViewerState) -> str:
        """Say what is shown."""
        switches = (
            ("morph", state.morph_from is not None),
            ("blink", state.blink_since is not None),
            ("wireframe", state.wireframe),
            ("points", state.points),
        )
        on = [word for word, there in switches if there]
        return ", ".join([self.title(state.stage), f"colours: {self.meaning(state)}", *on])

    def _renew(self) -> None:
        surfaces = self.surfaces
        own = (INPUT_COLORS,) if self._own_colors() is not None else ()
        self.run = Run(
            names=surfaces.names,
            before=tuple(surfaces.before(stage) for stage in range(len(surfaces.names))),
            meanings=meanings_of(surfaces) + own,
            own=tuple(own_meaning(name) for name in surfaces.names),
            points=AttenuationStage.name in surfaces.records,
        )

    def _own_colors(self) -> NDArray[np.float64] | None:
        """Return the input's colours on the welded vertices, those of the relief where it is all there is."""
        scene: Any = self.surfaces.records.get(SceneStage.name)
        cut = self.surfaces.cut
        if scene is None:
            return None
        colors = np.tile(np.array(PLASTER), (len(scene.vertices), 1))
        if self._colors is not None and not self.foreign_colors:
            used = scene.welded_index >= 0
            colors[scene.welded_index[used]] = self._colors[used]
            return colors
        if cut is not None and cut.colors is not None:
            for some in (cut.made, ~cut.made):  # a vertex's own colour counts, where it is still there
                colors[cut.welded[some]] = cut.colors[some]
            return colors
        return None
