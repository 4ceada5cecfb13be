"""The command o3d-relief make."""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from o3d_relief.console import tell, tell_result, tell_stage, tell_unused, write_report, write_stages
from o3d_relief.errors import FileError, MeshError, ParameterError, ReliefError
from o3d_relief.files import check_exists, check_folder, check_place
from o3d_relief.option_words import as_options
from o3d_relief.plate_arguments import chosen_plate
from o3d_relief.relief_arguments import chosen_params, chosen_view
from o3d_relief.scan_arguments import chosen_scan
from o3d_relief.scan_params import ScanParams
from o3d_relief.workshop_arguments import check_workshop, chosen_mill, chosen_tiles

if TYPE_CHECKING:
    from open3d.geometry import PointCloud, TriangleMesh

    from o3d_relief.making import Made
    from o3d_relief.params import ReliefParams, View
    from o3d_relief.plate_params import PlateParams
    from o3d_relief.relief import Relief
    from o3d_relief.workshop_params import MillParams

__all__ = ["make", "read_scene"]


def make(options: argparse.Namespace) -> int:
    """Run the command "make".

    Parameters
    ----------
    options : argparse.Namespace

    Returns
    -------
    int
        Exit code: 0, or 3 for a solid with warnings where --strict is given.

    Raises
    ------
    ReliefError
        Anything that the user can mend.
    """
    plate = chosen_plate(options)
    params, view = chosen_params(options), chosen_view(options)
    mill, tiles, scan = chosen_mill(options), chosen_tiles(options), chosen_scan(options)
    check_workshop(plate, mill, tiles)
    check_exists(options.input)
    taken = _check_places(options)
    tell_unused(params)

    from o3d_relief.making import make_checked
    from o3d_relief.pipeline import make_relief
    from o3d_relief.progress_bar import StageBar
    from o3d_relief.scene.scan import scan_points
    from o3d_relief.scene.write import lost_attributes

    _check_endings(options, solid=plate is not None)
    started = time.perf_counter()
    scene, meshing = read_scene(options.input, scan)
    if meshing is None and plate is None:
        for note in lost_attributes(options.output, scene):
            tell(note)
    bar = StageBar()
    scanned = None
    try:
        if meshing is not None and (options.dry_run or plate is not None):
            # Its size must be known before the relief is made.
            scanned = scan_points(scene, meshing, view=view, on_stage=tell_stage, on_progress=bar)
            scene, meshing = scanned.mesh, None
        if plate is not None:
            params = _fitted(options, scene, params, view, plate, mill)
        if options.dry_run:
            _rehearse(options, scene, params, view, plate, mill)
            return 0
        relief = make_relief(
            scene if scanned is None else scanned,
            params,
            view=view,
            scan=meshing,
            on_stage=tell_stage,
            on_progress=bar,
            max_triangles=options.max_triangles,
        )
        made = None
        if plate is not None:
            made = make_checked(
                relief,
                plate,
                lambda line: tell(as_options(line, vars(options))),
                mill=mill,
                undercut_free=options.undercut_free,
                tiles=tiles,
                on_progress=bar,
            )
    except MeshError as error:
        raise MeshError(f"{options.input}: {error}") from error
    finally:
        bar.close()
    solids = _write(options, relief, made, taken)
    tell_result(options.output, relief, time.perf_counter() - started, solids=solids)
    return 3 if options.strict and made is not None and made.report.verdict != "pass" else 0


def _fitted(
    options: argparse.Namespace,
    scene: TriangleMesh,
    params: ReliefParams,
    view: View,
    plate: PlateParams,
    mill: MillParams | None,
) -> ReliefParams:
    """Return parameters with the depth that makes the solid as deep as asked for; refuse too many pixels."""
    from o3d_relief.making import check_mill
    from o3d_relief.solid.estimate import relief_depth

    most = options.max_triangles
    if mill is not None:
        check_mill(scene, view, plate, mill, undercut_free=options.undercut_free, max_triangles=most)
    if plate.depth_mm is None:
        return params
    return replace(params, depth=relief_depth(scene, view, plate, max_triangles=most))


def _rehearse(
    options: argparse.Namespace,
    scene: TriangleMesh,
    params: ReliefParams,
    view: View,
    plate: PlateParams | None,
    mill: MillParams | None,
) -> None:
    """Go as far as can be told without the long work, and say what would come of it."""
    from o3d_relief.making import tell_estimate
    from o3d_relief.rehearsal import check_scene

    most, free = options.max_triangles, options.undercut_free
    check_scene(scene, params, view, most, solid=plate is not None)
    tell_estimate(scene, params, view, plate, tell, mill=mill, undercut_free=free, max_triangles=most)


def _write(options: argparse.Namespace, relief: Relief, made: Made | None, taken: set[Path]) -> list[Path]:
    """Write all files, and return those of the solid."""
    from o3d_relief.progress_bar import shown
    from o3d_relief.scene.write import write_mesh
    from o3d_relief.workshop import write_work

    failures: tuple[str, ...] = ()
    if options.strict or options.report is not None:
        with shown("certificate"):
            failures = tuple(relief.certificate.failures)
        tell(f"certificate: {'fails' if failures else 'clean'}")
        for sentence in failures:
            tell(f"  {sentence}")
    if options.strict:
        failures += () if made is None else tuple(made.report.failures)
        if failures:
            if options.report is not None:  # why it is refused is not lost
                write_report(options.report, relief, made)
            raise ReliefError(f"{options.output} is not written (--strict): {failures[0]}")
    solids: list[Path] = []
    with shown("writing"):
        if made is None:
            write_mesh(options.output, relief.mesh)
        else:
            solids = write_work(options.output, made.work, height_map=options.height_map, taken=taken)
    if options.report is not None:
        write_report(options.report, relief, made)
    if options.walls is not None and made is not None:
        made.draw_walls(options.walls)
    if options.stages is not None:
        write_stages(options.stages, relief)
    return solids


def read_scene(path: Path, scan: ScanParams) -> tuple[TriangleMesh | PointCloud, ScanParams | None]:
    """Read a scene and say what it is.

    Parameters
    ----------
    path : Path
    scan : ScanParams
        How a point cloud is to be meshed.

    Returns
    -------
    scene : open3d.geometry.TriangleMesh or open3d.geometry.PointCloud
    scan : ScanParams or None
        For a point cloud, with what its file says of the scanner.

    Raises
    ------
    ReliefError
        Anything that the user can mend.
    """
    from o3d_relief.progress_bar import shown
    from o3d_relief.scene.arrays import MeshArrays, to_open3d
    from o3d_relief.scene.read import left_out, read_arrays

    with shown("reading"):
        arrays = read_arrays(path)
    if isinstance(arrays, MeshArrays):
        tell(f"{path}: {len(arrays.vertices)} vertices, {len(arrays.faces)} triangles")
        for note in left_out(path, arrays):
            tell(note)
        if scan != ScanParams(seed=scan.seed):
            raise ParameterError(f"{path} is a mesh: the options for scans are for point clouds only.")
        return to_open3d(arrays), None
    carried = [
        name
        for name, there in (("colours", arrays.colors is not None), ("normals", arrays.normals is not None))
        if there
    ]
    words = f", with {' and '.join(carried)}" if carried else ""
    if arrays.sensor is not None and scan.sensor is None:
        scan = replace(scan, sensor=arrays.sensor)
        words += f", seen from {' '.join(f'{c:g}' for c in arrays.sensor)}"
    tell(f"{path}: a point cloud of {len(arrays.points)} points{words}; it is meshed first")
    return arrays.to_open3d(), scan


def _check_places(options: argparse.Namespace) -> set[Path]:
    """Check before the long work that everything can be written, and nothing over something else.

    Returns the files that nothing else may replace.
    """
    check_place(options.output)
    taken = {options.input.resolve(): "the input", options.output.resolve(): "the output"}
    if len(taken) == 1:
        raise FileError(f"{options.output} is the input, which would be lost: choose another output.")
    if options.params is not None:
        if options.params.resolve() == options.output.resolve():
            raise FileError(f"{options.output} is the parameter file: choose another output.")
        taken[options.params.resolve()] = "the parameter file"
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
    if options.stages is not None:
        check_folder(options.stages)
    return set(taken)


def _check_endings(options: argparse.Namespace, *, solid: bool) -> None:
    """Check that there is a writer for each file."""
    from o3d_relief.scene.write import check_writable
    from o3d_relief.solid.formats import check_solid_writable
    from o3d_relief.solid.heightmap import check_height_map

    (check_solid_writable if solid else check_writable)(options.output)
    if options.height_map is not None:
        check_height_map(options.height_map)
    if options.walls is not None and options.walls.suffix.lower() != ".png":
        raise FileError(f"{options.walls} cannot be written: the picture of the walls must end in .png.")
