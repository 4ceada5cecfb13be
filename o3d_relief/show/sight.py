"""What the live editor's window is told."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from o3d_relief.editor import EditorPoints, ReliefEditor
from o3d_relief.params import ReliefParams, View

__all__ = ["Sight", "Work"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Sight:
    """What there is to see.

    Attributes
    ----------
    vertices : (n, 3) float64
        Of the relief, in the relief frame, in relief units.
    faces : (m, 3) int64
    points : EditorPoints
    params : ReliefParams
        Their depth a length.
    view : View
    unit : float
        Length of one relief unit in the input's unit.
    scene_depth : float
        Of the scene, in the input's unit.
    version : int
        Grows with every other surface.
    final : bool
        Whether the surface is that of the finished relief; False for the preview.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    points: EditorPoints
    params: ReliefParams
    view: View
    unit: float
    scene_depth: float
    version: int
    final: bool

    @classmethod
    def of(cls, editor: ReliefEditor, version: int, surface: NDArray[np.float64] | None) -> Sight:
        """Look at an editor.

        Parameters
        ----------
        editor : ReliefEditor
        version : int
        surface : (n, 3) float64 or None
            The vertices of the finished relief, in relief units; None for the preview.
        """
        points, vertices = editor.points, editor.vertices / editor.unit
        if surface is not None:
            places = surface[editor.welded_index[points.vertex]] * editor.unit
            points, vertices = replace(points, new_position=places), surface
        return cls(
            vertices=vertices,
            faces=editor.faces,
            points=points,
            params=editor.params.settled(editor.visible_depth),
            view=editor.view,
            unit=editor.unit,
            scene_depth=float(np.ptp(editor.scene_vertices[:, 2])),
            version=version,
            final=surface is not None,
        )


@dataclass(frozen=True, kw_only=True)
class Work:
    """What goes on.

    Attributes
    ----------
    doing : str
        Empty where nothing is done.
    share : float or None
        How much of it is done.
    sentence : str
        The last thing that went wrong or is to be told, empty after a change that went well.
    wrong : bool
        Whether the sentence tells of something that went wrong.
    failed : bool
        Whether the editor could not be opened at all, or broke.
    """

    doing: str = ""
    share: float | None = None
    sentence: str = ""
    wrong: bool = False
    failed: bool = False
