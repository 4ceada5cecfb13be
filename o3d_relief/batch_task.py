"""One input of a batch, from its file to the file of its relief, on whatever machine."""

from __future__ import annotations

import json
import threading
import time
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

from o3d_relief.batch_entry import PICTURES, BatchEntry
from o3d_relief.batch_manifest import Notes
from o3d_relief.batch_recipe import BatchTask
from o3d_relief.errors import ReliefError
from o3d_relief.scan_params import ScanParams

if TYPE_CHECKING:
    from open3d.geometry import PointCloud, TriangleMesh

__all__ = [
    "MOST_ATTEMPTS",
    "error_sentence",
    "lost_entry",
    "read_input",
    "run_task",
]

MOST_ATTEMPTS = 2
"""An input that has cost so many workers their lives is given up."""

_PICTURE = (320, 320)

_ALONE = threading.Lock()
"""Workers of several threads make one relief at a time: the threads of the linear algebra are set for a whole
process, and nobody counts on the memory of two."""


def run_task(task: BatchTask) -> BatchEntry:
    """Make one relief.

    Parameters
    ----------
    task : BatchTask

    Returns
    -------
    BatchEntry
        Whatever goes wrong with the input is said in it.

    Raises
    ------
    FileError
        The batch was killed, and another one has begun in its folder: this worker writes nothing there.
    """
    notes = Notes(Path(task.folder), task.run)
    with _ALONE:
        kept = notes.entry(task.input)
        if kept is not None and kept.holds(Path(task.folder), task.digest):
            return kept  # by a worker that was lost before it could tell
        if notes.attempts(task.input) >= MOST_ATTEMPTS:
            return lost_entry(task, notes)
        attempts = notes.begin(task.input)
        started = time.perf_counter()
        try:
            found = Path(task.input).stat()
            stamp = {"input_bytes": found.st_size, "input_mtime_ns": found.st_mtime_ns}
        except OSError:  # reading it will say why
            stamp = {}
        try:
            entry = _make(task, notes, started, {"attempts": attempts, **stamp})
        except Exception as error:  # noqa: BLE001, whatever is wrong with one input must not stop the others
            entry = task.entry(
                status="failed",
                seconds=_since(started),
                error=error_sentence(error),
                attempts=attempts,
                **stamp,
            )
            notes.keep(entry)
        notes.end(task.input)
        return entry


def lost_entry(task: BatchTask, notes: Notes) -> BatchEntry:
    """Return, and note, the entry of an input that has cost its workers their lives.

    Parameters
    ----------
    task : BatchTask
    notes : Notes

    Returns
    -------
    BatchEntry
    """
    attempts = notes.attempts(task.input)
    entry = task.entry(
        status="failed",
        seconds=0.0,
        error=f"The worker was lost {attempts} times while it worked on this file: it crashed, or the system "
        "ended it, mostly for want of memory. Try it alone with o3d-relief make.",
        attempts=attempts,
    )
    notes.keep(entry)
    notes.end(task.input)
    return entry


def _since(started: float) -> float:
    return round(time.perf_counter() - started, 3)


def error_sentence(error: Exception) -> str:
    """Say what went wrong with an input.

    Parameters
    ----------
    error : Exception

    Returns
    -------
    str
    """
    if isinstance(error, ReliefError):
        return str(error)
    if isinstance(error, MemoryError):
        return "The memory is used up: reduce the mesh, or use fewer workers or a machine with more memory."
    return f"An unexpected {type(error).__name__}: {error}"


def _make(task: BatchTask, notes: Notes, started: float, known: dict[str, Any]) -> BatchEntry:
    from o3d_relief.files import remove_files, write_files
    from o3d_relief.pipeline import make_relief
    from o3d_relief.scene.write import lost_attributes, mesh_files
    from o3d_relief.show.render import render, save_png

    recipe, folder = task.recipe, Path(task.folder)
    scene, scan, left_out = read_input(Path(task.input), recipe.scan)
    relief = make_relief(
        scene, recipe.params, view=recipe.view, scan=scan, max_triangles=recipe.max_triangles
    )
    output = folder / task.output
    picture_file = folder / PICTURES / f"{output.stem}.png"
    known |= {
        "depth": float(relief.mesh.get_max_bound()[2]),
        "triangles": len(relief.mesh.triangles),
        "notes": (*left_out, *(lost_attributes(task.output, scene) if scan is None else ())),
    }
    del scene  # a certificate takes memory of its own
    if recipe.certified:
        known["certificate"] = json.loads(json.dumps(relief.report()["certificate"]))  # as it is read again
    files = mesh_files(output, relief.mesh)
    if recipe.strict and relief.certificate.failures:
        notes.check()
        remove_files(output, files)  # what an earlier run has left
        remove_files(picture_file, ())
        refused = f"{task.output} is not written (strict=True): {' '.join(relief.certificate.failures)}"
        entry = task.entry(status="failed", error=refused, seconds=_since(started), **known)
        notes.keep(entry)
        return entry
    title = f"{output.stem}, {known['depth']:.4g} deep"
    picture = render(relief.mesh, size=_PICTURE, plate=True, title=title)
    checksum = sha256(files[output.name]).hexdigest()
    entry = task.entry(status="made", seconds=_since(started), output_sha256=checksum, **known)
    # The note comes first: killed in between, its checksum does not fit what is there, and all is done again.
    # Where it can no longer be made, nothing is written.
    notes.keep(entry)
    save_png(picture_file, picture)
    write_files(output, files)
    return entry


def read_input(
    path: Path, scan: ScanParams
) -> tuple[TriangleMesh | PointCloud, ScanParams | None, list[str]]:
    """Read an input.

    Parameters
    ----------
    path : Path
    scan : ScanParams

    Returns
    -------
    scene : open3d.geometry.TriangleMesh or open3d.geometry.PointCloud
    scan : ScanParams or None
        How it is meshed, where it is a point cloud.
    left_out : list of str
        What of the file was not read.
    """
    from o3d_relief.scene.arrays import MeshArrays, to_open3d
    from o3d_relief.scene.read import left_out, read_arrays

    arrays = read_arrays(path)
    if isinstance(arrays, MeshArrays):
        return to_open3d(arrays), None, left_out(path, arrays)
    if arrays.sensor is not None and scan.sensor is None:
        scan = replace(scan, sensor=arrays.sensor)
    return arrays.to_open3d(), scan, []
