"""Which files a batch takes, and what their reliefs are called."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from o3d_relief.batch_entry import BatchEntry
from o3d_relief.errors import FileError, ParameterError
from o3d_relief.param_checks import told

__all__ = ["find_inputs", "output_names"]


def find_inputs(inputs: Iterable[str | Path]) -> list[str]:
    """Return the files, each once.

    Parameters
    ----------
    inputs : iterable of path
        A folder stands for all files in it that can be read, by name.

    Returns
    -------
    list of str
        Whole paths. Files that are missing are among them: they are for the batch to report.

    Raises
    ------
    ParameterError
        No inputs, or one path in place of several.
    FileError
        A folder without any file that can be read, or inputs of which none is there.
    """
    from o3d_relief.scene.read import READABLE, READABLE_CLOUDS

    try:
        places = [] if isinstance(inputs, str | Path) else [Path(place) for place in inputs]
    except TypeError:
        places = []
    if not places:
        raise ParameterError(f"inputs must be a sequence of files, at least one. Got {told(inputs)} instead.")
    # Path.exists would raise for names that are too long.
    if not any(os.path.exists(place) for place in places):  # noqa: PTH110
        rest = "" if len(places) == 1 else ", nor is any other of the inputs there"
        raise FileError(f"There is no file or folder {places[0]}{rest}: check the name.")
    found: list[Path] = []
    for place in places:
        if not place.is_dir():
            found.append(place)
            continue
        files = sorted(
            path
            for path in place.iterdir()
            if path.suffix.lower() in READABLE + READABLE_CLOUDS and path.is_file()
        )
        if not files:
            raise FileError(f"There is no mesh and no point cloud in the folder {place}.")
        found += files
    return list(dict.fromkeys(str(path.resolve()) for path in found))


def output_names(
    sources: Sequence[str], folder: Path, entries: Mapping[str, BatchEntry], ending: str
) -> dict[str, str]:
    """Choose names for reliefs: those of the inputs, with a number where they are taken.

    Parameters
    ----------
    sources : sequence of str
        Whole paths, each once.
    folder : Path
        Whole path of the folder of the batch.
    entries : mapping of str to BatchEntry
        What the folder holds already, by input: an input keeps its name, and no other gets it.
    ending : str

    Returns
    -------
    dict of str to str
        The name for each input.

    Examples
    --------
    >>> output_names(["/a/x.ply", "/b/x.obj", "/a/x_2.ply"], Path("/out"), {}, ".stl")
    {'/a/x.ply': 'x.stl', '/a/x_2.ply': 'x_2.stl', '/b/x.obj': 'x_3.stl'}
    """
    # Pictures are called like the reliefs, and some file systems do not tell capitals from small letters.
    taken = {Path(entry.output).stem.casefold() for entry in entries.values()}
    taken |= {Path(source).stem.casefold() for source in sources if Path(source).parent == folder}
    names = {source: Path(entries[source].output).stem + ending for source in sources if source in entries}
    later = []
    for source in sources:
        stem = Path(source).stem
        if source in names:
            continue
        if stem.casefold() in taken:
            later.append(source)
        else:
            names[source] = stem + ending
            taken.add(stem.casefold())
    for source in later:
        stem, number = Path(source).stem, 2
        while f"{stem}_{number}".casefold() in taken:
            number += 1
        names[source] = f"{stem}_{number}{ending}"
        taken.add(f"{stem}_{number}".casefold())
    return names
