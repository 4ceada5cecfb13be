"""The live editor without its window: changes are asked for and carried out on a thread of their own."""

from __future__ import annotations

import threading
import time
import traceback
from collections.abc import Callable
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from o3d_relief.editor import ReliefEditor
from o3d_relief.errors import Cancelled, ReliefError
from o3d_relief.params import ReliefParams, View
from o3d_relief.records import final_heights
from o3d_relief.scene.write import write_mesh
from o3d_relief.show.agenda import Act, Agenda, Request
from o3d_relief.show.sight import Sight, Work

if TYPE_CHECKING:
    import open3d as o3d

    from o3d_relief.relief import Relief

__all__ = ["Studio"]

_GOES_ON = 1.5  # seconds between two values of one slider that count as one change
_OPENING = "the responses of the surface"


class Studio:
    """Carries out changes of a relief one after the other; finishes the relief when they rest.

    Parameters
    ----------
    mesh : open3d.geometry.TriangleMesh
    params : ReliefParams
    view : View
    on_news : callable
        Called from the other thread whenever `sight` or `work` is another one. It must be quick.
    rest : float
        Seconds without a change after which the relief is finished.
    finishing : bool
        Whether it is finished at all.
    """

    def __init__(
        self,
        mesh: o3d.geometry.TriangleMesh,
        params: ReliefParams,
        view: View,
        on_news: Callable[[], None],
        *,
        rest: float = 0.7,
        finishing: bool = True,
    ) -> None:
        self.sight: Sight | None = None
        self.work = Work(doing=_OPENING)
        self._first = mesh, params, view
        self._on_news: Callable[[], None] | None = on_news
        self._agenda = Agenda(self._finish, rest=rest, finishing=finishing)
        self._last = ("", 0.0)
        self._number = count()
        self._relief: Relief | None = None
        self._editor: ReliefEditor | None = None
        self._thread = threading.Thread(target=self._live, daemon=True)
        self._thread.start()

    # What the window asks for; all of it returns at once.

    def ask(self, name: str, act: Act, *, doing: str = "", delay: float = 0.0, changes: bool = True) -> None:
        """Ask for a change; one of the same name that still waits is dropped for it.

        Parameters
        ----------
        name : str
        act : callable
        doing : str
            What is told while it lasts.
        delay : float
            Seconds to wait for a newer one of the same name.
        changes : bool
            Whether the relief is another one afterwards.
        """
        due = time.monotonic() + delay
        self._agenda.ask(Request(name=name, act=act, doing=doing, due=due, changes=changes))

    def change(self, name: str, *, slow: bool = False, **values: Any) -> None:
        """Ask for other parameters, or another `view`.

        Parameters
        ----------
        name : str
            Of the slider or button.
        slow : bool
            Whether it may take seconds: it then waits until the slider rests.
        **values
            See `ReliefEditor.change`.
        """
        self.ask(
            name,
            lambda editor, continued: editor.change(continued=continued, **values),
            doing=_OPENING if slow else "",
            delay=0.4 if slow else 0.0,
        )

    def undo(self) -> None:
        """Ask for the state before the last change."""
        self.ask(f"undo {next(self._number)}", lambda editor, _continued: editor.undo())  # none is dropped

    def redo(self) -> None:
        """Ask for the change that was taken back last."""
        self.ask(f"redo {next(self._number)}", lambda editor, _continued: editor.redo())

    def save_relief(self, path: Path) -> None:
        """Ask for the relief in a file."""

        def save(_editor: ReliefEditor, _continued: bool) -> None:
            relief = self._finished()
            write_mesh(path, relief.mesh)
            self._tell(sentence=f"saved {path}")

        self.ask("save relief", save, doing="the relief", changes=False)

    def save_params(self, path: Path) -> None:
        """Ask for the parameters, the view and the edits in a file."""

        def save(editor: ReliefEditor, _continued: bool) -> None:
            editor.save(path)
            self._tell(sentence=f"saved {path}")

        self.ask("save params", save, changes=False)

    def finish(self, *, wanted: bool) -> None:
        """Say whether the relief is to be finished when the changes rest."""
        self._agenda.finish(wanted=wanted)
        if not wanted:
            self.ask("preview", lambda _editor, _continued: None, changes=True)

    def cancel(self) -> None:
        """Call off what is being done; the preview stays until the next change."""
        self._agenda.cancel()

    def close(self) -> tuple[ReliefParams, View] | None:
        """End all work and wait for its end.

        Returns
        -------
        params, view
            The last ones; None where the editor could not be opened.
        """
        self._on_news = None
        self._agenda.close()
        self._thread.join()
        return None if self._editor is None else (self._editor.params, self._editor.view)

    # What the other thread does.

    def _live(self) -> None:
        mesh, params, view = self._first
        try:
            editor = ReliefEditor(mesh, params, view=view, on_progress=self._watch_change)
        except (ReliefError, MemoryError) as error:
            self._tell(sentence=_sentence(error), failed=True)
            return
        self._editor, self._agenda.unfinished = editor, True
        self._show(editor)
        try:
            while (request := self._agenda.next()) is not None:
                self._carry_out(editor, request)
        except Exception as error:  # noqa: BLE001, the window must tell, it would wait for ever otherwise
            traceback.print_exc()
            self._tell(sentence=f"The editor broke: {error!r}. Nothing more can be changed.", failed=True)

    def _carry_out(self, editor: ReliefEditor, request: Request) -> None:
        name, when = self._last
        continued = name == request.name and time.monotonic() - when < _GOES_ON
        self._tell(doing=request.doing)
        try:
            request.act(editor, continued)
        except Cancelled:
            self._tell(sentence="called off" if self._agenda.called_off else None)
            return
        except (ReliefError, MemoryError) as error:
            self._tell(sentence=_sentence(error), wrong=True)
            return
        finally:
            self._agenda.done()
        if not request.changes:
            self._tell()
            return
        self._last = request.name, time.monotonic()
        self._relief, self._agenda.unfinished = None, True
        self._show(editor, sentence="")

    def _finish(self, editor: ReliefEditor, _continued: bool) -> None:
        relief = self._finished()
        z = final_heights(relief.stages)
        if self.sight is not None and len(z) == len(self.sight.vertices):
            surface = np.column_stack([editor.vertices[:, :2] / editor.unit, z])
            self._show(editor, surface)

    def _finished(self) -> Relief:
        if self._editor is None:
            raise ReliefError("There is no relief yet.")
        if self._relief is None:
            self._relief = self._editor.relief(on_progress=self._watch)
        return self._relief

    def _watch_change(self, stage: str, share: float | None) -> bool:
        """Tell how far a change is; call it off where asked to, or where a newer one makes it void."""
        if self._editor is None:  # the beginning, without which there is nothing
            if not self._agenda.closed:
                self._tell(doing=stage, share=share)
            return not self._agenda.closed
        if self._agenda.change_is_void():
            return False
        self._tell(doing=stage, share=share)
        return True

    def _watch(self, stage: str, share: float | None) -> bool:
        """Tell how far the relief is; call it off where a change waits, but not while it is to be saved."""
        if self._agenda.relief_is_void():
            return False
        self._tell(doing=stage, share=share)
        return True

    def _show(
        self,
        editor: ReliefEditor,
        surface: NDArray[np.float64] | None = None,
        sentence: str | None = None,
    ) -> None:
        version = 0 if self.sight is None else self.sight.version + 1
        self.sight = Sight.of(editor, version, surface)
        self._tell(sentence=sentence)

    def _tell(
        self,
        *,
        doing: str = "",
        share: float | None = None,
        sentence: str | None = None,
        wrong: bool = False,
        failed: bool = False,
    ) -> None:
        """Tell what goes on; where no sentence is given the last one stays."""
        if sentence is None:
            sentence, wrong = self.work.sentence, self.work.wrong
        self.work = Work(doing=doing, share=share, sentence=sentence, wrong=wrong or failed, failed=failed)
        news = self._on_news
        if news is not None:
            news()

    @property
    def waiting(self) -> bool:
        """Whether a request has not been carried out yet."""
        return self._agenda.waiting


def _sentence(error: BaseException) -> str:
    return "The memory is used up: reduce the mesh." if isinstance(error, MemoryError) else str(error)
