"""The command o3d-relief batch."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from o3d_relief.batch_manifest import MANIFEST
from o3d_relief.console import tell, tell_unused
from o3d_relief.option_words import as_options
from o3d_relief.relief_arguments import chosen_params, chosen_view
from o3d_relief.scan_arguments import chosen_scan

if TYPE_CHECKING:
    from o3d_relief.batch_entry import BatchEntry
    from o3d_relief.batch_rehearsal import Rehearsal
    from o3d_relief.params import ReliefParams, View
    from o3d_relief.scan_params import ScanParams

__all__ = ["batch"]


def batch(options: argparse.Namespace) -> int:
    """Run the command "batch".

    Parameters
    ----------
    options : argparse.Namespace

    Returns
    -------
    int
        Exit code: 0 where there is a relief of each input, 3 where some failed, 2 where all did.

    Raises
    ------
    ReliefError
        Anything that the user can mend.
    """
    params, view, scan = chosen_params(options), chosen_view(options), chosen_scan(options)
    tell_unused(params)
    if options.dry_run:
        return _rehearse(options, params, view, scan)

    from o3d_relief.batch import make_reliefs
    from o3d_relief.progress_bar import BatchBar

    bar = BatchBar()
    try:
        made = make_reliefs(
            options.inputs,
            options.out,
            params,
            view=view,
            scan=scan,
            ending=f".{options.format}",
            jobs=options.jobs,
            engine=options.engine,
            scheduler=options.scheduler,
            max_triangles=options.max_triangles,
            certificates=options.certificates,
            strict=options.strict,
            on_done=lambda entry: bar.write(tell, _line(entry, options)),
            on_progress=bar,
        )
    finally:
        bar.close()
    failed = len(made.failed)
    earlier = f", {made.already_done} of them from an earlier run" if made.already_done else ""
    tell(f"{options.out}: {len(made.entries) - failed} reliefs{earlier}")
    if failed:
        tell(f"{failed} of {len(made.entries)} inputs failed: see {options.out / MANIFEST}")
    for sheet in made.sheets:
        tell(f"look at {sheet}")
    if failed == len(made.entries):
        return 2
    return 3 if failed else 0


def _rehearse(options: argparse.Namespace, params: ReliefParams, view: View, scan: ScanParams) -> int:
    """Tell what a batch would make; return the exit code that it would have but for certificates."""
    from o3d_relief.batch_engine import check_engine
    from o3d_relief.batch_recipe import Recipe
    from o3d_relief.batch_rehearsal import rehearse_reliefs

    check_engine(options.engine, options.scheduler, options.jobs)
    recipe = Recipe(
        params=params,
        view=view,
        scan=scan,
        ending=f".{options.format}",
        max_triangles=options.max_triangles,
        strict=options.strict,
        certificates=options.certificates,
    )
    found = []
    for one in rehearse_reliefs(options.inputs, options.out, recipe):
        found.append(one)
        tell(_rehearsed(one, options))
    failed, done = sum(one.error is not None for one in found), sum(one.already_done for one in found)
    tell(f"{options.out}: {len(found) - failed - done} reliefs to make, {done} there from an earlier run")
    if failed:
        tell(f"{failed} of {len(found)} inputs would fail")
    return 2 if failed == len(found) else 3 if failed else 0


def _rehearsed(one: Rehearsal, options: argparse.Namespace) -> str:
    """Return what is said of an input before the work."""
    if one.error is not None:
        return f"would fail: {_failure(one.input, one.output, one.error, options)}"
    if one.estimate is None:
        return f"{one.input} -> {one.output}: there from an earlier run"
    found = one.estimate
    x, y, z = (format(side, ".4g") for side in found.size)
    size = f"{x} x {y} x {'' if found.depth_known else 'at most '}{z} in the unit of the file"
    needs = f"about {found.triangles} triangles, {found.memory_mb / 1000.0:.1f} GB of memory"
    return f"{one.input} -> {one.output}: {found.visible_depth:.4g} deep as seen; {size}; {needs}"


def _failure(source: str, name: str, error: str, options: argparse.Namespace) -> str:
    """Return what is wrong with an input, in the words of the command line."""
    places = (source, str(Path(source).parent), str(options.out.resolve() / name), name)
    told = as_options(error, vars(options), places)
    return told if source in error else f"{source}: {told}"


def _line(entry: BatchEntry, options: argparse.Namespace) -> str:
    """Return what is said of an input, notes included."""
    if not entry.made:
        return f"failed: {_failure(entry.input, entry.output, str(entry.error), options)}"
    told = f"{entry.triangles} triangles, {entry.depth:.4g} deep, {entry.seconds:.1f} s"
    if entry.certificate is not None:
        told += f"; certificate: {'fails' if entry.failures else 'clean'}"
    head = f"{entry.input} -> {entry.output}: {told}"
    return "\n  ".join([head, *entry.failures, *entry.notes])
