"""The command o3d-relief."""

from __future__ import annotations

import argparse
import os
import signal
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

from o3d_relief.arguments import parse
from o3d_relief.batch_command import batch
from o3d_relief.console import make_folder, tell, tell_result, tell_stage, write_report, write_stages
from o3d_relief.edit_command import edit
from o3d_relief.errors import ReliefError
from o3d_relief.make_command import make
from o3d_relief.option_words import as_options
from o3d_relief.params import ReliefParams
from o3d_relief.view_command import view

__all__ = ["main", "run"]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command.

    Parameters
    ----------
    arguments : sequence of str, optional
        Without the program's name; those of the process where omitted.

    Returns
    -------
    int
        Exit code: 0, 2 for anything the user can mend, 3 for warnings with --strict and for a batch of which
        some inputs failed, 130 when interrupted.
    """
    given = list(sys.argv[1:] if arguments is None else arguments)
    signals: list[int] = []
    options = argparse.Namespace()

    def stop(number: int, _frame: object) -> None:
        signals.append(number)
        raise KeyboardInterrupt

    # SIGTERM ends like Ctrl-C, so that what is half done is cleaned away.
    before = {number: signal.signal(number, stop) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        options = parse(given)
        commands = {"make": make, "batch": batch, "demo": _demo, "view": view, "edit": edit}
        return commands[options.command](options)
    except ReliefError as error:
        tell(f"o3d-relief: error: {as_options(str(error), vars(options), _places(options))}")
        return 2
    except MemoryError:
        tell("o3d-relief: error: the memory is used up: reduce the mesh, or use a machine with more memory.")
        return 2
    except BaseException:
        # An interrupted import of a compiled library may arrive as any error.
        if not signals:
            raise
        tell("o3d-relief: interrupted; no file is left half-written.")
        return 128 + signals[0]
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _places(options: argparse.Namespace) -> list[str]:
    """Return the names of files and folders that were given, but for those that may be parameters, too."""
    values = [
        one
        for value in vars(options).values()
        for one in (value if isinstance(value, list) else [value])
        if isinstance(one, Path)
    ]
    return [str(path) for path in values if not str(path).isidentifier()]


def run() -> NoReturn:
    """Run the command and end the process with its exit code."""
    code = main()
    if "open3d" not in sys.modules and any(name.startswith("open3d.") for name in sys.modules):
        # An import that was interrupted leaves memory behind, for which Open3D would end the process with 1.
        sys.stderr.flush()
        os._exit(code)
    sys.exit(code)


def _demo(options: argparse.Namespace) -> int:
    folder = options.directory
    make_folder(folder)

    import numpy as np

    from o3d_relief.pipeline import make_relief
    from o3d_relief.progress_bar import StageBar
    from o3d_relief.scene.demo import demo_scene
    from o3d_relief.scene.write import write_mesh
    from o3d_relief.show.render import save_png
    from o3d_relief.show.sheets import view_sheet

    started = time.perf_counter()
    scene = demo_scene()
    tell(f"built-in scene: {len(scene.vertices)} vertices, {len(scene.triangles)} triangles")
    bar = StageBar()
    try:
        relief = make_relief(scene, ReliefParams(alpha=0.8), on_stage=tell_stage, on_progress=bar)
    finally:
        bar.close()
    write_mesh(folder / "scene.ply", scene)
    write_mesh(folder / "relief.ply", relief.mesh)
    write_mesh(folder / "relief.glb", relief.mesh)
    write_report(folder / "report.json", relief)
    write_stages(folder / "stages", relief)
    in_relief_frame = scene.transform(np.linalg.inv(relief.to_scene))
    save_png(folder / "sheet.png", view_sheet(in_relief_frame, relief.mesh))
    tell_result(folder / "relief.ply", relief, time.perf_counter() - started)
    tell(f"look at {folder / 'sheet.png'} and at the pictures in {folder / 'stages'}")
    return 0
