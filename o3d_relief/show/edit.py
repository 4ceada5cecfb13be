"""The live editor: a window in which a relief follows its parameters and single points."""

from __future__ import annotations

import contextlib
import os
import pickle
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from o3d_relief.array_checks import check_size
from o3d_relief.errors import DisplayError, MeshError, ReliefError
from o3d_relief.files import check_place
from o3d_relief.param_checks import check_positive, given
from o3d_relief.params import ReliefParams, View
from o3d_relief.params_file import load_params
from o3d_relief.scene.arrays import from_open3d
from o3d_relief.scene.convert import mesh_arrays
from o3d_relief.scene.write import check_writable
from o3d_relief.show.display import require_display, require_vulkan
from o3d_relief.show.messages import EditorOpening

if TYPE_CHECKING:
    import open3d as o3d

__all__ = ["edit"]


def edit(
    mesh: o3d.geometry.TriangleMesh,
    params: ReliefParams | None = None,
    view: View | None = None,
    *,
    output: str | Path | None = None,
    size_mm: float = 150.0,
    title: str = "o3d-relief edit",
    size: tuple[int, int] = (1280, 860),
) -> tuple[ReliefParams, View]:
    """Edit a relief in a window, until it is closed.

    Parameters
    ----------
    mesh : open3d.geometry.TriangleMesh
        The scene; never modified.
    params : ReliefParams, optional
    view : View, optional
    output : str or Path, optional
        Where "Save relief" writes to; where omitted, it asks.
    size_mm : float
        Length of the relief's larger side in millimetres, for the slider of the depth.
    title : str
        Of the window.
    size : (width, height)
        Of the window, in pixels.

    Returns
    -------
    params, view
        The last ones, the edits of single points among them: `make_relief` makes the same relief of them.

    Raises
    ------
    DisplayError
        There is no display or no driver, or the window broke.
    ReliefError
        No relief can be made of this mesh with these parameters.
    """
    params, view = given("params", params, ReliefParams), given("view", view, View)
    size_mm = check_positive("size_mm", size_mm)
    size = check_size(size)
    place = None if output is None else Path(output).absolute()
    if place is not None:
        check_place(place)
        check_writable(place)
    require_display()
    require_vulkan()
    mesh_arrays(mesh)  # what cannot become a relief is said before a window opens
    with tempfile.TemporaryDirectory(prefix="o3d-relief-") as folder:
        result = Path(folder) / "params.json"
        opening = EditorOpening(
            scene=from_open3d(mesh),
            params=params,
            view=view,
            output=place,
            size_mm=size_mm,
            title=title,
            size=size,
            result=result,
        )
        code, words = _run(opening)
        if code == 0:
            return load_params(result)
    if code == 2:
        raise ReliefError(words)
    raise DisplayError(f"The editor's window broke (exit code {code}): {words}")


def _run(opening: EditorOpening) -> tuple[int, str]:
    """Run the window's process; return its exit code and the last line that it said."""
    home = str(Path(__file__).parents[2])
    search = os.pathsep.join(filter(None, [home, os.environ.get("PYTHONPATH", "")]))
    process = subprocess.Popen(
        [sys.executable, "-m", "o3d_relief.show.editor_process"],
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,  # the renderer talks
        stderr=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": search},
    )
    if process.stdin is None or process.stderr is None:
        raise MeshError("The window's process has no input.")
    last = ""
    try:
        with contextlib.suppress(BrokenPipeError):  # its exit code says more
            pickle.dump(opening, process.stdin, protocol=pickle.HIGHEST_PROTOCOL)
            process.stdin.flush()
        for line in process.stderr:
            last = line.decode(errors="replace").strip() or last
        return process.wait(), last.removeprefix("o3d-relief: error: ")
    finally:
        with contextlib.suppress(BrokenPipeError):
            process.stdin.close()
        process.stderr.close()
        process.terminate()
        process.wait()
