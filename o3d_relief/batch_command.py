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
    from o3d_relief.batch_manifest import BatchEntry

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


def _line(entry: BatchEntry, options: argparse.Namespace) -> str:
    """Return what is said of an input, notes included."""
    if not entry.made:
        output = str(options.out.resolve() / entry.output)
        folder = str(Path(entry.input).parent)
        error = as_options(str(entry.error), vars(options), (entry.input, folder, output, entry.output))
        return f"failed: {error}" if entry.input in str(entry.error) else f"failed: {entry.input}: {error}"
    told = f"{entry.triangles} triangles, {entry.depth:.4g} deep, {entry.seconds:.1f} s"
    if entry.certificate is not None:
        told += f"; certificate: {'fails' if entry.failures else 'clean'}"
    head = f"{entry.input} -> {entry.output}: {told}"
    return "\n  ".join([head, *entry.failures, *entry.notes])
