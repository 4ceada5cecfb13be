"""The MANIFEST.tsv of a folder of meshes: how each of them is looked at."""

from __future__ import annotations

import csv
from pathlib import Path

import o3d_relief as rel

__all__ = ["files", "row_of", "view_of"]


def _rows(folder: Path) -> list[dict[str, str]]:
    path = folder / "MANIFEST.tsv"
    if not path.is_file():
        raise SystemExit(
            f"{path} does not exist: name a folder of meshes with a table of the columns file, "
            "suggested_view_from and up."
        )
    with path.open(encoding="utf-8") as file:
        return list(csv.DictReader(file, delimiter="\t"))


def row_of(folder: Path, name: str) -> dict[str, str]:
    """Return what the manifest of a folder says of a file."""
    for row in _rows(folder):
        if row["file"] == name:
            return row
    raise SystemExit(f"{folder / 'MANIFEST.tsv'} says nothing of {name}.")


def files(folder: Path) -> list[str]:
    """Return the names of all files of a folder, in the order of its manifest."""
    return [row["file"] for row in _rows(folder)]


def view_of(folder: Path, name: str) -> rel.View:
    """Return where a scene faces and which way is up."""
    row = row_of(folder, name)
    side = row["suggested_view_from"].split()[0]  # "z+", or "z+ (3/4 better)"
    return rel.View(front=side[1].replace("+", "") + side[0], up=row["up"])
