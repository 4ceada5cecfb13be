"""The command o3d-relief."""

from __future__ import annotations

import argparse
import json
import signal
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from o3d_relief.arguments import chosen_params, chosen_plate, chosen_view, parse
from o3d_relief.errors import FileError, MeshError, ReliefError
from o3d_relief.files import check_exists, check_place, write_bytes
from o3d_relief.params import ReliefParams
from o3d_relief.plate_params import PlateParams
from o3d_relief.workshop_arguments import check_workshop, chosen_mill, chosen_tiles

if TYPE_CHECKING:
    from o3d_relief.making import Made
    from o3d_relief.pipeline import Relief
    from o3d_relief.records import StageRecord

__all__ = ["main"]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command.

    Parameters
    ----------
    arguments : sequence of str, optional
        Without the program's name; those of the process where omitted.

    Returns
    -------
    int
        Exit code: 0, 2 for anything the user can mend, 3 for warnings with --strict, 130 when interrupted.
    """
    given = list(sys.argv[1:] if arguments is None else arguments)
    signals: list[int] = []

    def stop(number: int, _frame: object) -> None:
        signals.append(number)
        raise KeyboardInterrupt

    # SIGTERM ends like Ctrl-C, so that what is half done is cleaned away.
    before = {number: signal.signal(number, stop) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        options = parse(given)
        return {"make": _make, "demo": _demo}[options.command](options)
    except ReliefError as error:
        sys.stderr.write(f"o3d-relief: error: {error}\n")
        return 2
    except (KeyboardInterrupt, ImportError):
        # An interrupted import of Open3D arrives as an ImportError.
        if not signals:
            raise
        sys.stderr.write("o3d-relief: interrupted; no file is left half-written.\n")
        return 128 + signals[0]
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _tell(text: str) -> None:
    sys.stderr.write(text + "\n")
    sys.stderr.flush()


def _tell_stage(record: StageRecord) -> None:
    counts = ", ".join(f"{name.replace('_', ' ')} {count}" for name, count in record.counts.items() if count)
    _tell(f"  {record.name:<13}{record.seconds:6.2f} s  {counts}".rstrip())


def _make(options: argparse.Namespace) -> int:
    params, view, plate = chosen_params(options), chosen_view(options), chosen_plate(options)
    mill, tiles = chosen_mill(options), chosen_tiles(options)
    check_workshop(plate, mill, tiles)
    check_exists(options.input)
    taken = _check_places(options)

    from o3d_relief.making import make_checked, tell_estimate
    from o3d_relief.pipeline import make_relief
    from o3d_relief.scene.read import read_mesh
    from o3d_relief.scene.write import write_mesh
    from o3d_relief.solid.estimate import relief_depth
    from o3d_relief.workshop import write_work

    _check_endings(options, solid=plate is not None)
    started = time.perf_counter()
    mesh = read_mesh(options.input)
    _tell(f"{options.input}: {len(mesh.vertices)} vertices, {len(mesh.triangles)} triangles")
    try:
        if options.dry_run:
            tell_estimate(mesh, params, view, plate or PlateParams(), _tell)
            return 0
        if plate is not None and plate.depth_mm is not None:
            params = replace(params, depth=relief_depth(mesh, view, plate))
        relief = make_relief(mesh, params, view=view, on_stage=_tell_stage)
        made = None
        if plate is not None:
            made = make_checked(
                relief, plate, _tell, mill=mill, undercut_free=options.undercut_free, tiles=tiles
            )
    except MeshError as error:
        raise MeshError(f"{options.input}: {error}") from error
    if options.strict and relief.certificate.failures:
        raise ReliefError(f"{options.output} is not written (--strict): {relief.certificate.failures[0]}")
    if options.strict and made is not None and made.report.failures:
        raise ReliefError(f"{options.output} is not written (--strict): {made.report.failures[0]}")
    if made is None:
        write_mesh(options.output, relief.mesh)
    else:
        write_work(options.output, made.work, height_map=options.height_map, taken=taken)
    if options.report is not None:
        _write_report(options.report, relief, made)
    if options.walls is not None and made is not None:
        made.draw_walls(options.walls)
    if options.stages is not None:
        _write_stages(options.stages, relief)
    _tell_result(options.output, relief, time.perf_counter() - started, solid=made is not None)
    return 3 if options.strict and made is not None and made.report.verdict != "pass" else 0


def _check_places(options: argparse.Namespace) -> set[Path]:
    """Check before the long work that everything can be written, and nothing over something else.

    Returns the files that nothing else may replace.
    """
    check_place(options.output)
    taken = {options.input.resolve(): "the input", options.output.resolve(): "the output"}
    if len(taken) == 1:
        raise FileError(f"{options.output} is the input, which would be lost: choose another output.")
    for name, path in (
        ("report", options.report),
        ("picture", options.walls),
        ("height map", options.height_map),
    ):
        if path is None:
            continue
        check_place(path)
        if path.resolve() in taken:
            raise FileError(f"{path} is {taken[path.resolve()]}: choose another {name}.")
        taken[path.resolve()] = f"the {name}"
    if options.stages is not None and options.stages.exists() and not options.stages.is_dir():
        raise FileError(f"{options.stages} is a file, not a folder for pictures.")
    return set(taken)


def _check_endings(options: argparse.Namespace, *, solid: bool) -> None:
    """Check that there is a writer for each file."""
    from o3d_relief.scene.write import check_writable
    from o3d_relief.solid.formats import check_solid_writable
    from o3d_relief.solid.heightmap import check_height_map

    (check_solid_writable if solid else check_writable)(options.output)
    if options.height_map is not None:
        check_height_map(options.height_map)


def _demo(options: argparse.Namespace) -> int:
    folder = options.directory
    _make_folder(folder)

    import numpy as np

    from o3d_relief.pipeline import make_relief
    from o3d_relief.scene.demo import demo_scene
    from o3d_relief.scene.write import write_mesh
    from o3d_relief.show.render import save_png
    from o3d_relief.show.sheets import view_sheet

    started = time.perf_counter()
    scene = demo_scene()
    _tell(f"built-in scene: {len(scene.vertices)} vertices, {len(scene.triangles)} triangles")
    relief = make_relief(scene, ReliefParams(alpha=0.8), on_stage=_tell_stage)
    write_mesh(folder / "scene.ply", scene)
    write_mesh(folder / "relief.ply", relief.mesh)
    write_mesh(folder / "relief.glb", relief.mesh)
    _write_report(folder / "report.json", relief)
    _write_stages(folder / "stages", relief)
    in_relief_frame = scene.transform(np.linalg.inv(relief.to_scene))
    save_png(folder / "sheet.png", view_sheet(in_relief_frame, relief.mesh))
    _tell_result(folder / "relief.ply", relief, time.perf_counter() - started)
    _tell(f"look at {folder / 'sheet.png'} and at the pictures in {folder / 'stages'}")
    return 0


def _make_folder(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(f"The folder {folder} cannot be made: {error.strerror}.") from error


def _write_report(path: Path, relief: Relief, made: Made | None = None) -> None:
    values = relief.report() | ({} if made is None else made.values())
    write_bytes(path, (json.dumps(values, indent=2) + "\n").encode())


def _write_stages(folder: Path, relief: Relief) -> None:
    from o3d_relief.show.sheets import save_stage_pictures

    _make_folder(folder)
    _tell(f"drawing {len(relief.stages)} stage pictures, a few seconds each")
    save_stage_pictures(
        relief.stages, folder, relief=relief.mesh, on_picture=lambda picture: _tell(f"  {picture}")
    )


def _tell_result(path: Path, relief: Relief, seconds: float, *, solid: bool = False) -> None:
    report = relief.summary()
    if relief.stages["compression"].counts.get("already_shallower"):
        _tell(
            f"the relief is {report['relief_depth']:.4g} deep, less than was asked for: it is not stretched"
        )
    if left := relief.stages["order"].counts.get("left", 0):
        _tell(f"{left} pairs of surfaces could not be brought back into order; a smaller k may help")
    if solid:
        _tell(f"{path}: the solid, {seconds:.1f} s in all")
        return
    _tell(
        f"{path}: {report['vertices']} vertices, {report['triangles']} triangles; "
        f"depth {report['scene_depth']:.4g} -> {report['relief_depth']:.4g}, {seconds:.1f} s in all"
    )
