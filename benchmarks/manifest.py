"""The MANIFEST.tsv of a folder of meshes: how each of them is looked at."""

from __future__ import annotations

import csv
from pathlib import Path

import o3d_relief as rel

__all__ = ["files", "view_of"]


def _rows(folder: Path) -> list[dict[str, str]]:
    with (folder / "MANIFEST.tsv").open(encoding="utf-8") as file:
        return list(csv.DictReader(file, delimiter="\t"))


def files(folder: Path) -> list[str]:
    """Return the names of all files of a folder, in the order of its manifest."""
    return [row["file"] for row in _rows(folder)]


def view_of(folder: Path, name: str) -> rel.View:
    """Return where a scene faces and which way is up."""
    row = next(row for row in _rows(folder) if row["file"] == name)
    side = row["suggested_view_from"].split()[0]  # "z+", or "z+ (3/4 better)"
    return rel.View(front=side[1].replace("+", "") + side[0], up=row["up"])
