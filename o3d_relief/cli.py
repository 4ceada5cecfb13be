"""The command o3d-relief."""

from __future__ import annotations

import argparse
import json
import re
import signal
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

from o3d_relief import __version__
from o3d_relief.errors import FileError, MeshError, ReliefError
from o3d_relief.files import check_exists, check_place, write_bytes
from o3d_relief.params import ReliefParams, View

if TYPE_CHECKING:
    from o3d_relief.pipeline import Relief
    from o3d_relief.records import StageRecord

__all__ = ["main"]

_POINTS = ("--front", "--up", "--viewpoint", "--vanishing-point")
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?$")
_AXIS = re.compile(r"[+-]?[xyzXYZ]$")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command.

    Parameters
    ----------
    arguments : sequence of str, optional
        Without the program's name; those of the process where omitted.

    Returns
    -------
    int
        Exit code: 0, 2 for anything the user can mend, 130 when interrupted.
    """
    given = list(sys.argv[1:] if arguments is None else arguments)
    signals: list[int] = []

    def stop(number: int, _frame: object) -> None:
        signals.append(number)
        raise KeyboardInterrupt

    # SIGTERM ends like Ctrl-C, so that what is half done is cleaned away.
    before = {number: signal.signal(number, stop) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        options = _parser().parse_args(_join_points(given))
        options.run(options)
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
    return 0


class _Parser(argparse.ArgumentParser):
    """A parser that says what is wrong in one sentence."""

    def error(self, message: str) -> NoReturn:
        sys.stderr.write(f"{self.prog}: error: {message} (see {self.prog} --help)\n")
        raise SystemExit(2)


def _join_points(arguments: list[str]) -> list[str]:
    """Join '--front -y', '--front 0 -1 0' and '--front -1,0,0' to one word, which argparse needs."""
    joined = []
    position = 0
    while position < len(arguments):
        word = arguments[position]
        following = arguments[position + 1 : position + 4]
        position += 1
        if word in _POINTS and following:
            if len(following) == 3 and all(_NUMBER.match(item) for item in following):
                word, position = f"{word}={','.join(following)}", position + 3
            elif _AXIS.match(following[0]) or "," in following[0]:
                word, position = f"{word}={following[0]}", position + 1
        joined.append(word)
    return joined


def _numbers(text: str) -> tuple[float, ...]:
    try:
        return tuple(float(item) for item in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"must be numbers with commas between them. Got {text!r} instead."
        ) from None


def _point(text: str) -> tuple[float, ...]:
    numbers = _numbers(text)
    if len(numbers) != 3:
        raise argparse.ArgumentTypeError(f"must be three numbers. Got {text!r} instead.")
    return numbers


def _direction(text: str) -> str | tuple[float, ...]:
    if _AXIS.match(text):
        return text
    try:
        return _point(text)
    except argparse.ArgumentTypeError:
        raise argparse.ArgumentTypeError(
            f"must be x, -x, y, -y, z, -z or three numbers. Got {text!r} instead."
        ) from None


def _beta(text: str) -> float | tuple[float, ...]:
    numbers = _numbers(text)
    return numbers[0] if len(numbers) == 1 else numbers


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(prog="o3d-relief", description="Make high reliefs from 3D scenes.", allow_abbrev=False)
    parser.add_argument("--version", action="version", version=f"o3d-relief {__version__}")
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")

    make = commands.add_parser(
        "make", help="make a relief of a mesh file", description="Make a relief of a mesh file."
    )
    make.add_argument("input", type=Path, metavar="INPUT", help="PLY, OBJ, STL, OFF, GLB or glTF file")
    make.add_argument("output", type=Path, metavar="OUTPUT", help="PLY, OBJ, STL or GLB file")
    _add_view(make)
    _add_params(make)
    make.add_argument(
        "--report", type=Path, metavar="FILE.json", help="write parameters, counts, times and depths"
    )
    make.add_argument("--stages", type=Path, metavar="DIR", help="write a picture of each stage")
    make.add_argument(
        "--strict", action="store_true", help="refuse a relief that does not keep what the certificate tests"
    )
    make.set_defaults(run=_make)

    demo = commands.add_parser(
        "demo",
        help="make a relief of the built-in scene, with pictures",
        description="Make a relief of the built-in scene, with a picture of each stage and a sheet of views.",
    )
    demo.add_argument(
        "directory",
        type=Path,
        nargs="?",
        default=Path("relief-demo"),
        metavar="DIR",
        help="default: %(default)s",
    )
    demo.set_defaults(run=_demo)
    return parser


def _add_view(command: argparse.ArgumentParser) -> None:
    group = command.add_argument_group("view", "directions are x, -x, y, ... or three numbers")
    group.add_argument(
        "--front",
        type=_direction,
        default="z",
        metavar="DIR",
        help="from the scene to the viewer (default: z)",
    )
    group.add_argument("--up", type=_direction, default="y", metavar="DIR", help="default: y")
    group.add_argument(
        "--viewpoint", type=_point, metavar="X Y Z",
        help="what is visible is seen from here, in relief units (default: infinitely far)",
    )  # fmt: skip
    group.add_argument(
        "--vanishing-point", type=_point, metavar="X Y Z",
        help="forced perspective towards this point behind the plane, in relief units (default: none)",
    )  # fmt: skip


def _add_params(command: argparse.ArgumentParser) -> None:
    default = ReliefParams()
    group = command.add_argument_group("relief")
    add = group.add_argument
    add("-k", type=int, default=default.k, metavar="N", help="attenuation points (default: %(default)s)")
    add("--beta", type=_beta, default=default.beta, metavar="B[,B...]",
        help="attenuation factor, one or one per point (default: %(default)s)")  # fmt: skip
    for name, text in (
        ("discard_above", "t1: drop points with a larger relative differential"),
        ("attach_below", "t2: attach points with a smaller relative differential"),
        ("max_order_error", "t3: solve vertices with a larger depth order error again"),
        ("blend", "t: share of first order differentials there"),
    ):
        add(f"--{name.replace('_', '-')}", type=float, default=getattr(default, name), metavar="T",
            help=f"{text} (default: %(default)s)")  # fmt: skip
    add("--no-smooth-points", dest="smooth_points", action="store_false",
        help="the paper's own restoration, without smoothing around the points")  # fmt: skip
    add("--no-in-front", dest="in_front", action="store_false",
        help="the paper's own behaviour: visible parts may end behind the plane and are trimmed")  # fmt: skip
    add("--no-in-order", dest="in_order", action="store_false",
        help="the paper's own behaviour: parts may pass through each other")  # fmt: skip
    add("--min-gap", type=float, default=default.min_gap, metavar="G",
        help="smallest gap in depth between parts, in the input's unit (default: %(default)s)")  # fmt: skip
    add("--alpha", type=float, metavar="A", help="largest compression ratio (default: no compression)")
    add("--alpha-min", type=float, metavar="A", help="smallest compression ratio (default: half of alpha)")
    add("--depth", type=float, metavar="D", help="exact depth in the input's unit, instead of alpha")
    add("--seed", type=int, default=default.seed, metavar="N", help="default: %(default)s")


def _view(options: argparse.Namespace) -> View:
    return View(
        front=options.front,
        up=options.up,
        viewpoint=options.viewpoint,
        vanishing_point=options.vanishing_point,
    )


def _params(options: argparse.Namespace) -> ReliefParams:
    names = ReliefParams.__dataclass_fields__
    return ReliefParams(**{name: getattr(options, name) for name in names})


def _tell(text: str) -> None:
    sys.stderr.write(text + "\n")
    sys.stderr.flush()


def _tell_stage(record: StageRecord) -> None:
    counts = ", ".join(f"{name.replace('_', ' ')} {count}" for name, count in record.counts.items() if count)
    _tell(f"  {record.name:<13}{record.seconds:6.2f} s  {counts}".rstrip())


def _make(options: argparse.Namespace) -> None:
    params, view = _params(options), _view(options)
    check_exists(options.input)
    _check_places(options)

    from o3d_relief.pipeline import make_relief
    from o3d_relief.scene.read import read_mesh
    from o3d_relief.scene.write import check_writable, write_mesh

    check_writable(options.output)
    started = time.perf_counter()
    mesh = read_mesh(options.input)
    _tell(f"{options.input}: {len(mesh.vertices)} vertices, {len(mesh.triangles)} triangles")
    try:
        relief = make_relief(mesh, params, view=view, on_stage=_tell_stage)
    except MeshError as error:
        raise MeshError(f"{options.input}: {error}") from error
    if options.strict and relief.certificate.failures:
        raise ReliefError(f"{options.output} is not written (--strict): {relief.certificate.failures[0]}")
    write_mesh(options.output, relief.mesh)
    if options.report is not None:
        _write_report(options.report, relief)
    if options.stages is not None:
        _write_stages(options.stages, relief)
    _tell_result(options.output, relief, time.perf_counter() - started)


def _check_places(options: argparse.Namespace) -> None:
    """Check before the long work that everything can be written, and nothing over something else."""
    check_place(options.output)
    taken = {options.input.resolve(): "the input", options.output.resolve(): "the output"}
    if len(taken) == 1:
        raise FileError(f"{options.output} is the input, which would be lost: choose another output.")
    if options.report is not None:
        check_place(options.report)
        if options.report.resolve() in taken:
            raise FileError(f"{options.report} is {taken[options.report.resolve()]}: choose another report.")
    if options.stages is not None and options.stages.exists() and not options.stages.is_dir():
        raise FileError(f"{options.stages} is a file, not a folder for pictures.")


def _demo(options: argparse.Namespace) -> None:
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


def _make_folder(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(f"The folder {folder} cannot be made: {error.strerror}.") from error


def _write_report(path: Path, relief: Relief) -> None:
    write_bytes(path, (json.dumps(relief.report(), indent=2) + "\n").encode())


def _write_stages(folder: Path, relief: Relief) -> None:
    from o3d_relief.show.sheets import save_stage_pictures

    _make_folder(folder)
    _tell(f"drawing {len(relief.stages)} stage pictures, a few seconds each")
    save_stage_pictures(
        relief.stages, folder, relief=relief.mesh, on_picture=lambda picture: _tell(f"  {picture}")
    )


def _tell_result(path: Path, relief: Relief, seconds: float) -> None:
    report = relief.summary()
    if relief.stages["compression"].counts.get("already_shallower"):
        _tell(
            f"the relief is {report['relief_depth']:.4g} deep, less than was asked for: it is not stretched"
        )
    if left := relief.stages["order"].counts.get("left", 0):
        _tell(f"{left} pairs of surfaces could not be brought back into order; a smaller k may help")
    _tell(
        f"{path}: {report['vertices']} vertices, {report['triangles']} triangles; "
        f"depth {report['scene_depth']:.4g} -> {report['relief_depth']:.4g}, {seconds:.1f} s in all"
    )
