"""The stage viewer: a window beside a run, which shows each stage as soon as it is computed."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

from o3d_relief.array_checks import check_size
from o3d_relief.errors import DisplayError
from o3d_relief.param_checks import check_kind, given
from o3d_relief.params import View
from o3d_relief.records import StageRecord
from o3d_relief.relief import Relief
from o3d_relief.show.display import require_display
from o3d_relief.show.mesh_colors import vertex_colors
from o3d_relief.show.messages import Done, Opening
from o3d_relief.show.stage_surfaces import CutRelief

if TYPE_CHECKING:
    import open3d as o3d

__all__ = ["StageViewer", "show_stages"]


class StageViewer:
    """A window that shows the stages of a run, to be given to `make_relief` as `on_stage`.

    The window lives in a process of its own: it answers while the pipeline computes, and the run goes on
    when it is closed. The keys are those of the window's first line in the console.

    Parameters
    ----------
    mesh : open3d.geometry.TriangleMesh, optional
        The scene, for its colours.
    view : View, optional
        For its viewpoint.
    title : str
        Of the window.
    size : (width, height)
        Of the window, in pixels.

    Raises
    ------
    DisplayError
        There is no display.
    ParameterError
        `view` is no View, or `size` not two whole numbers.
    MeshError
        A mesh without a triangle to show.
    """

    def __init__(
        self,
        mesh: o3d.geometry.TriangleMesh | None = None,
        view: View | None = None,
        *,
        title: str = "o3d-relief",
        size: tuple[int, int] = (1200, 900),
    ) -> None:
        view = given("view", view, View)
        size = check_size(size)
        require_display()
        home = str(Path(__file__).parents[2])
        search = os.pathsep.join(filter(None, [home, os.environ.get("PYTHONPATH", "")]))
        self._closed_here = False
        self._process = subprocess.Popen(
            [sys.executable, "-m", "o3d_relief.show.viewer_process"],
            stdin=subprocess.PIPE,
            env={**os.environ, "PYTHONPATH": search},
        )
        try:
            colors = None if mesh is None else vertex_colors(mesh)  # while the process wakes up
        except BaseException:
            self.close()
            raise
        self._send(Opening(viewpoint=view.viewpoint, colors=colors, title=title, size=size))

    def __call__(self, record: StageRecord) -> None:
        """Show a stage."""
        self._send(record)

    def __enter__(self) -> StageViewer:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @property
    def closed(self) -> bool:
        """Whether the window is gone."""
        return self._process.poll() is not None

    def finish(self, relief: Relief) -> None:
        """Show the finished relief with its cut, and let the window stay when this program ends.

        Parameters
        ----------
        relief : Relief
        """
        self._send(CutRelief.of(relief))
        self._send(Done())

    def wait(self) -> None:
        """Wait until the window is closed by hand.

        Raises
        ------
        DisplayError
            It could not be opened, or it broke.
        """
        code = self._process.wait()
        self._end_input()
        if code != 0 and not self._closed_here:
            raise DisplayError(f"The window of the stages ended with an error (exit code {code}).")

    def close(self) -> None:
        """Close the window, if it is still there; who waits for that goes on."""
        if self._process.poll() is None:  # one that broke before was not closed
            self._closed_here = True
        self._end_input()
        self._process.terminate()
        self._process.wait()

    def _send(self, message: Any) -> None:
        stream = self._process.stdin
        if stream is None or stream.closed:
            return
        try:
            pickle.dump(message, stream, protocol=pickle.HIGHEST_PROTOCOL)
            stream.flush()
        except (BrokenPipeError, OSError):  # the window was closed: the run goes on without it
            self._end_input()

    def _end_input(self) -> None:
        stream = self._process.stdin
        if stream is not None and not stream.closed:
            try:
                stream.close()
            except OSError:  # what was left to write has no reader any more
                return


def show_stages(relief: Relief, mesh: o3d.geometry.TriangleMesh | None = None) -> None:
    """Step through the stages of a relief in a window, until it is closed.

    Parameters
    ----------
    relief : Relief
    mesh : open3d.geometry.TriangleMesh, optional
        The scene, for the colours of what the cut has taken away.

    Raises
    ------
    DisplayError
        There is no display, or the window could not be opened.
    ParameterError
        `relief` is no Relief.
    MeshError
        A mesh without a triangle to show.
    """
    check_kind("relief", relief, Relief, "make_relief")
    with StageViewer(mesh, relief.view) as viewer:
        for record in relief.stages.values():
            viewer(record)
        viewer.finish(relief)
        viewer.wait()
