"""What a batch is to make of which inputs."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

from o3d_relief import __version__
from o3d_relief.batch_entry import BatchEntry
from o3d_relief.batch_inputs import output_names
from o3d_relief.errors import ParameterError
from o3d_relief.param_checks import check_kind, check_whole
from o3d_relief.params import ReliefParams, View
from o3d_relief.scan_params import ScanParams

__all__ = ["BatchTask", "Recipe", "open_tasks"]

_WITHOUT_EFFECT = ("strict", "certificates")
"""They do not change what a relief is."""


@dataclass(frozen=True, kw_only=True)
class Recipe:
    """How the reliefs of a batch are made.

    Attributes
    ----------
    params : ReliefParams
    view : View
    scan : ScanParams
        For inputs that are point clouds.
    ending : str
        Of the reliefs' files: ".ply".
    max_triangles : int or None
    strict : bool
        Whether a relief whose certificate is not clean is refused.
    certificates : bool
        Whether a certificate is made of each relief; always where `strict` is.

    Raises
    ------
    ParameterError
        `strict` or `certificates` is not a bool, parameters are of another class, or `max_triangles` is not
        a positive whole number.
    """

    params: ReliefParams
    view: View
    scan: ScanParams
    ending: str
    max_triangles: int | None
    strict: bool = False
    certificates: bool = False

    def __post_init__(self) -> None:
        check_kind("params", self.params, ReliefParams)
        check_kind("view", self.view, View)
        check_kind("scan", self.scan, ScanParams)
        if self.max_triangles is not None:
            object.__setattr__(self, "max_triangles", check_whole("max_triangles", self.max_triangles))
        for name in ("strict", "certificates"):
            if not isinstance(getattr(self, name), bool):
                raise ParameterError(f"{name} must be True or False. Got {getattr(self, name)!r} instead.")

    @property
    def certified(self) -> bool:
        """Whether certificates are made."""
        return self.strict or self.certificates

    def digest(self) -> str:
        """Return the SHA-256 of what makes a relief the one it is, and of the package's version."""
        values = {name: value for name, value in asdict(self).items() if name not in _WITHOUT_EFFECT}
        text = json.dumps([__version__, values], sort_keys=True)
        return sha256(text.encode()).hexdigest()


@dataclass(frozen=True, kw_only=True)
class BatchTask:
    """One input and where its relief goes.

    Attributes
    ----------
    input : str
        The file, with its whole path.
    output : str
        Name of the relief in the folder.
    folder : str
        Of the batch, with its whole path.
    recipe : Recipe
    digest : str
        Of the recipe.
    run : str
        Name of the batch, by which its notes are found.
    """

    input: str
    output: str
    folder: str
    recipe: Recipe
    digest: str
    run: str

    def entry(self, **values: Any) -> BatchEntry:
        """Return what the manifest says of the input."""
        return BatchEntry(input=self.input, output=self.output, recipe=self.digest, **values)


def open_tasks(
    sources: list[str], folder: Path, entries: Mapping[str, BatchEntry], recipe: Recipe, run: str = ""
) -> tuple[dict[str, str], list[BatchTask]]:
    """Find out what is still to be done.

    Parameters
    ----------
    sources : list of str
        The inputs, with their whole paths.
    folder : Path
        Of the batch, with its whole path.
    entries : mapping of str to BatchEntry
        What the folder holds already, by input.
    recipe : Recipe
    run : str
        Name of the batch; empty where it is only rehearsed.

    Returns
    -------
    names : dict of str to str
        The name of each input's relief.
    tasks : list of BatchTask
        In the order of the inputs; none for a relief that is kept.
    """
    names, digest = output_names(sources, folder, entries, recipe.ending), recipe.digest()
    tasks = []
    for source in sources:
        entry = entries.get(source)
        kept = entry is not None and entry.output == names[source] and entry.holds(folder, digest)
        lacking = recipe.certified and entry is not None and entry.certificate is None
        refused = recipe.strict and entry is not None and entry.failures
        if not kept or lacking or refused:
            tasks.append(
                BatchTask(
                    input=source,
                    output=names[source],
                    folder=str(folder),
                    recipe=recipe,
                    digest=digest,
                    run=run,
                )
            )
    return names, tasks
