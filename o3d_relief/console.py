"""What the commands write: lines for the user, reports, pictures."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from o3d_relief.errors import FileError
from o3d_relief.files import write_bytes
from o3d_relief.option_words import as_options

if TYPE_CHECKING:
    from o3d_relief.making import Made
    from o3d_relief.params import ReliefParams
    from o3d_relief.records import StageRecord
    from o3d_relief.relief import Relief

__all__ = ["make_folder", "tell", "tell_result", "tell_stage", "tell_unused", "write_report", "write_stages"]


_LOOSE = 0.1
"""Gap of the energy, as a share of it, of which the user is told: a search that is complete leaves 0.03."""


def tell(text: str) -> None:
    """Write a line for the user."""
    if sys.stderr is None:  # closed when the program was started
        return
    # Where nobody reads on, the work still goes on.
    with suppress(BrokenPipeError):
        sys.stderr.write(text + "\n")
        sys.stderr.flush()


def tell_stage(record: StageRecord) -> None:
    """Write a line about a stage."""
    counts = ", ".join(f"{name.replace('_', ' ')} {count}" for name, count in record.counts.items() if count)
    tell(f"  {record.name:<13}{record.seconds:6.2f} s  {counts}".rstrip())


def tell_unused(params: ReliefParams) -> None:
    """Write a line about parameters that were given for nothing."""
    if params.unused:
        names = ", ".join(as_options(name, params.unused) for name in params.unused)
        tell(f"without effect, for the bounded mode has no attenuation points: {names}")


def make_folder(folder: Path) -> None:
    """Make a folder; FileError where that is not possible."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(f"The folder {folder} cannot be made: {error.strerror}.") from error


def write_report(path: Path, relief: Relief, made: Made | None = None) -> None:
    """Write the report of a relief, and of the solid made of it."""
    values = relief.report() | ({} if made is None else made.values())
    write_bytes(path, (json.dumps(values, indent=2) + "\n").encode())


def write_stages(folder: Path, relief: Relief) -> None:
    """Write a picture of each stage into a folder."""
    from o3d_relief.show.sheets import save_stage_pictures

    make_folder(folder)
    tell(f"drawing {len(relief.stages)} stage pictures, a few seconds each")
    save_stage_pictures(
        relief.stages, folder, relief=relief.mesh, on_picture=lambda picture: tell(f"  {picture}")
    )


def tell_result(path: Path, relief: Relief, seconds: float, *, solids: Sequence[Path] = ()) -> None:
    """Write what came out: the relief, or the files of its solid."""
    report = relief.summary()
    counts = {name: count for record in relief.stages.values() for name, count in record.counts.items()}
    if counts.get("already_shallower"):
        tell(
            f"the relief is {report['relief_depth']:.4g} deep, in the unit of the file, not more than it was "
            "before: it is not stretched (millimetres: --width-mm and --depth-mm)"
        )
    if left := counts.get("left", 0):
        if relief.params.bounded:
            tell(f"{left} gaps are smaller than asked for: the depth has no room for them")
        else:
            tell(f"{left} pairs of surfaces could not be brought back into order; a smaller k may help")
    gap = report["energy_gap"]
    if gap is not None and gap > _LOOSE:
        spared = f"{100.0 * gap:.0f} % of the change of shape"
        tell(f"the search ended before its goal: up to {spared} might be spared")
    if missed := counts.get("attached_missed", 0):
        tell(f"{missed} vertices could not be attached to the plane: something seen lies behind them")
    if len(solids) > 1:
        tell(f"{solids[0]} to {solids[-1].name}: {len(solids)} tiles, {seconds:.1f} s in all")
        return
    if solids:
        tell(f"{solids[0]}: the solid, {seconds:.1f} s in all")
        return
    tell(
        f"{path}: {report['vertices']} vertices, {report['triangles']} triangles; "
        f"depth that is seen {report['scene_visible_depth']:.4g} -> {report['relief_visible_depth']:.4g}, "
        f"{seconds:.1f} s in all"
    )
