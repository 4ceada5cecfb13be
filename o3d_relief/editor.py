"""Live changes of a relief, without a window."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from o3d_relief.errors import ParameterError
from o3d_relief.history import History
from o3d_relief.journal import OnStage
from o3d_relief.live_scene import LivePoints, LiveScene
from o3d_relief.param_checks import check_kind, given, told
from o3d_relief.params import ReliefParams, View
from o3d_relief.params_file import load_params, save_params
from o3d_relief.pipeline import make_relief
from o3d_relief.point_edits import PointEdit, merged
from o3d_relief.progress import OnProgress, Progress
from o3d_relief.records import AttenuationStage
from o3d_relief.relief import Relief
from o3d_relief.scene.convert import check_mesh

__all__ = ["EditorPoints", "ReliefEditor"]


@dataclass(frozen=True, kw_only=True, eq=False)
class EditorPoints:
    """The p attenuation points as an artist sees them, in the relief frame and the input's unit.

    Attributes
    ----------
    vertex : (p,) int64
        An input vertex of each point.
    position : (p, 3) float64
        In the scene.
    new_position : (p, 3) float64
        In the preview of the relief; a discarded point goes with the surface.
    action : (p,) str
        "attach", "scale" or "discard".
    beta : (p,) float64
        Attenuation factors.
    edited : (p,) bool
        Changed by hand.
    """

    vertex: NDArray[np.int64]
    position: NDArray[np.float64]
    new_position: NDArray[np.float64]
    action: NDArray[np.str_]
    beta: NDArray[np.float64]
    edited: NDArray[np.bool_]


class ReliefEditor:
    """A relief that follows changes of its parameters and of single points.

    What is expensive, the responses of the surface to each attenuation point, is computed once. A change of
    alpha, beta, the thresholds or single points is then a matter of milliseconds. It shows in `heights`, a
    preview: attenuation, construction and compression, without the restoration and the guarantees that
    come after the construction. `relief` makes the real thing, as `make_relief` does with the same `params`.

    A change of k, seed or view, or of `in_order` in a scene of several parts, takes as long as the
    beginning. In such a scene a change after which other parts than before hold a point is slower, too. The
    bounded mode has no points; its preview is linear scaling, from which its search starts.

    Memory: 4 n k bytes for the responses, 128 MB for 250,000 vertices and k = 128; while they are computed,
    and as long as parts are tied, 1 to 2 kB for each vertex.

    Parameters
    ----------
    mesh : open3d.geometry.TriangleMesh
        Not changed; the editor keeps a copy.
    params : ReliefParams, optional
    view : View, optional
    on_progress : callable, optional
        Told how far the beginning is, and a change that takes as long, see `make_relief`. Where it returns
        False the work ends with `Cancelled`, and everything stays as it was.

    Raises
    ------
    MeshError, ParameterError, SolverError
        As `make_relief`.
    Cancelled
        `on_progress` returned False.

    Examples
    --------
    >>> editor = ReliefEditor(o3d.geometry.TriangleMesh.create_sphere(), ReliefParams(k=4))
    >>> editor.change(beta=0.05)
    >>> editor.edit([0, 2], action="attach")
    >>> editor.undo()
    True
    >>> editor.params.beta, editor.params.point_edits
    (0.05, ())
    """

    def __init__(
        self,
        mesh: o3d.geometry.TriangleMesh,
        params: ReliefParams | None = None,
        *,
        view: View | None = None,
        on_progress: OnProgress | None = None,
    ) -> None:
        check_mesh("The scene", mesh)
        params, view = given("params", params, ReliefParams), given("view", view, View)
        self._mesh = o3d.geometry.TriangleMesh(mesh)
        self._first = params, view
        self._history: History[tuple[ReliefParams, View]] = History()
        self._progress = Progress(on_progress)
        self._scene = LiveScene(self._mesh, params, view, self._progress)
        self._live: LivePoints | None = None
        self._show(params, view)

    def _show(self, params: ReliefParams, view: View) -> None:
        """Go to other parameters; where that fails, everything stays as it was."""
        check_kind("view", view, View)
        scene = self._scene
        if view != scene.view:
            scene = LiveScene(self._mesh, params, view, self._progress)
        live, points = self._live, None
        if params.bounded:
            heights = scene.scaled(params)
        else:
            if live is None or not live.serve(scene, params):
                live = LivePoints(scene, params, self._progress)
            points, heights = live.preview(params)
        heights.flags.writeable = False
        self._scene, self._live, self._params = scene, live, params
        self._points: AttenuationStage | None = points
        self._heights: NDArray[np.float64] = heights

    @property
    def params(self) -> ReliefParams:
        """The parameters now, the edits of single points among them."""
        return self._params

    @property
    def view(self) -> View:
        """The view now."""
        return self._scene.view

    @property
    def heights(self) -> NDArray[np.float64]:
        """(n,) float64: the preview's height of each welded vertex, in relief units; negative behind S."""
        return self._heights

    @property
    def vertices(self) -> NDArray[np.float64]:
        """(n, 3) float64: the welded vertices of the preview, in the relief frame, in the input's unit."""
        return np.column_stack([self._scene.vertices[:, :2], self._heights]) * self.unit

    @property
    def faces(self) -> NDArray[np.int64]:
        """(m, 3) int64: the triangles of the welded vertices."""
        return self._scene.scene.faces

    @property
    def scene_vertices(self) -> NDArray[np.float64]:
        """(n, 3) float64: the welded vertices before, in the relief frame, in the input's unit."""
        return np.asarray(self._scene.vertices * self.unit)

    @property
    def welded_index(self) -> NDArray[np.int64]:
        """(n_in,) int64: the welded vertex of each input vertex, -1 for one that no triangle uses."""
        return self._scene.scene.welded_index

    @property
    def unit(self) -> float:
        """Length of one relief unit in the input's unit."""
        return self._scene.scene.unit

    @property
    def visible_depth(self) -> float:
        """Depth of what is visible of the scene, in the input's unit."""
        return self._scene.visible_depth

    @property
    def to_scene(self) -> NDArray[np.float64]:
        """(4, 4) float64: takes the relief frame to the input's frame."""
        return self._scene.frame.to_scene

    @property
    def points(self) -> EditorPoints:
        """The attenuation points now; none in bounded mode."""
        index, action, beta = np.zeros(0, dtype=np.int64), np.zeros(0, dtype="U7"), np.zeros(0)
        edited = index
        if self._points is not None and self._live is not None:
            index, action, beta = self._points.index, self._points.action, self._points.beta
            edited = self._live.edited(self._params.point_edits)
        vertices = self._scene.vertices[index]
        return EditorPoints(
            vertex=self._input_vertices(index),
            position=vertices * self.unit,
            new_position=np.column_stack([vertices[:, :2], self._heights[index]]) * self.unit,
            action=action,
            beta=beta,
            edited=np.isin(np.arange(len(index)), edited),
        )

    def _input_vertices(self, index: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the first input vertex of each of some welded vertices."""
        first = np.full(len(self._scene.vertices), -1, dtype=np.int64)
        used = np.flatnonzero(self.welded_index >= 0)[::-1]
        first[self.welded_index[used]] = used
        return np.asarray(first[index])

    def change(self, *, view: View | None = None, continued: bool = False, **params: Any) -> None:
        """Change parameters, and the view.

        Parameters
        ----------
        view : View, optional
        continued : bool
            Go on with the last change, as a slider that is dragged: one `undo` takes back both.
        **params
            Fields of `ReliefParams` by name.

        Raises
        ------
        ReliefError
            Values that do not fit; everything stays as it was.
        """
        for name in params:
            if name not in ReliefParams.__dataclass_fields__:
                raise ParameterError(f"{name!r} is not a parameter of a relief.")
        self._go(replace(self._params, **params), self.view if view is None else view, continued)

    def edit(
        self,
        points: int | Sequence[int] | NDArray[np.integer[Any]],
        *,
        action: str | None = None,
        beta: float | None = None,
        continued: bool = False,
    ) -> None:
        """Change single points by hand, several at once.

        Parameters
        ----------
        points : int or sequence of int
            Their numbers in `points`.
        action : "attach", "scale" or "discard", optional
            What becomes of them, see `PointEdit`; "scale" releases from the plane. None: as before.
        beta : float, optional
            Their attenuation factor. None: as before.
        continued : bool
            Go on with the last change: one `undo` takes back both.

        Raises
        ------
        ReliefError
            Values that do not fit; everything stays as it was.
        """
        live, chosen = self._numbers(points)
        if action is None and beta is None:
            raise ParameterError("An edit needs an action or a beta.")
        edits, concerned = self._params.point_edits, live.edited(self._params.point_edits)
        result = [edit for edit, i in zip(edits, concerned, strict=True) if i not in chosen]
        for number, vertex in zip(chosen, self._input_vertices(live.index[chosen]).tolist(), strict=True):
            # With what was edited before it is one edit.
            own = [edit for edit, i in zip(edits, concerned, strict=True) if i == number]
            result.append(merged(vertex, [*own, PointEdit(vertex=vertex, action=action, beta=beta)]))
        self.change(point_edits=result, continued=continued)

    def clear(self, points: int | Sequence[int] | NDArray[np.integer[Any]]) -> None:
        """Take back what was changed of single points by hand.

        Parameters
        ----------
        points : int or sequence of int
            Their numbers in `points`.
        """
        live, chosen = self._numbers(points)
        edits = self._params.point_edits
        concerned = live.edited(edits)
        self.change(point_edits=[edit for edit, i in zip(edits, concerned, strict=True) if i not in chosen])

    def _numbers(
        self, points: int | Sequence[int] | NDArray[np.integer[Any]]
    ) -> tuple[LivePoints, list[int]]:
        """Check numbers of points."""
        if self._live is None or self._points is None:
            raise ParameterError("The bounded mode has no attenuation points to edit.")
        numbers = np.unique(np.atleast_1d(np.asarray(points)))
        count = len(self._live.index)
        if len(numbers) and not np.issubdtype(numbers.dtype, np.integer):
            raise ParameterError(f"points must be whole numbers. Got {told(points)} instead.")
        if len(numbers) and not 0 <= numbers[0] <= numbers[-1] < count:
            wrong = numbers[0] if numbers[0] < 0 else numbers[-1]
            raise ParameterError(f"points must be between 0 and {count - 1}. Got {wrong} instead.")
        return self._live, [int(number) for number in numbers]

    def _go(self, params: ReliefParams, view: View, continued: bool = False) -> None:
        now = self._params, self.view
        self._show(params, view)
        self._history.keep(now, continued=continued)

    def undo(self) -> bool:
        """Take the last change back.

        Returns
        -------
        bool
            False where there is none.
        """
        return self._history.undo((self._params, self.view), self._show_both)

    def redo(self) -> bool:
        """Make the change that was taken back last again.

        Returns
        -------
        bool
            False where there is none.
        """
        return self._history.redo((self._params, self.view), self._show_both)

    def _show_both(self, wanted: tuple[ReliefParams, View]) -> None:
        self._show(*wanted)

    def reset(self) -> None:
        """Go back to the beginning; `undo` takes that back."""
        self._go(*self._first)

    def save(self, path: str | Path) -> None:
        """Write parameters, view and edits to a file, see `save_params`."""
        save_params(path, self._params, self.view)

    def load(self, path: str | Path) -> None:
        """Take parameters, view and edits from a file, see `load_params`; `undo` takes that back."""
        self._go(*load_params(path))

    def relief(self, *, on_stage: OnStage | None = None, on_progress: OnProgress | None = None) -> Relief:
        """Make the relief, with everything that the preview leaves out.

        Parameters
        ----------
        on_stage : callable, optional
            Called with each stage's record as soon as the stage is done.
        on_progress : callable, optional
            Told how far the stages are; may call the work off, see `make_relief`.

        Returns
        -------
        Relief
            The same as ``make_relief(mesh, editor.params, view=editor.view)``.
        """
        return make_relief(
            self._mesh, self._params, view=self.view, on_stage=on_stage, on_progress=on_progress
        )
