"""The reliefs of a batch on one sheet."""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import count, takewhile
from pathlib import Path

import numpy as np

from o3d_relief.batch_entry import PICTURES, BatchEntry
from o3d_relief.files import remove_files

__all__ = ["remove_sheets", "write_sheets"]

_ON_A_SHEET = 100


def write_sheets(folder: Path, entries: Iterable[BatchEntry]) -> list[Path]:
    """Put the pictures of reliefs on contact sheets.

    Parameters
    ----------
    folder : Path
        Of the batch.
    entries : iterable of BatchEntry
        Those without a relief are left out.

    Returns
    -------
    list of Path
        contact_sheet.png, contact_sheet_2.png, ... with up to a hundred reliefs each; none for no relief.
        Those of earlier runs that come after the last one are removed.

    Raises
    ------
    FileError
        A sheet cannot be written, or an old one not be removed.
    """
    from PIL import Image

    from o3d_relief.show.render import save_png
    from o3d_relief.show.sheets import contact_sheet

    pictures = [folder / PICTURES / f"{Path(entry.output).stem}.png" for entry in entries if entry.made]
    there = [picture for picture in pictures if picture.is_file()]
    sheets = []
    for start in range(0, len(there), _ON_A_SHEET):
        images = []
        for picture in there[start : start + _ON_A_SHEET]:
            with Image.open(picture) as image:
                images.append(np.asarray(image.convert("RGB")))
        sheets.append(_sheet(folder, start // _ON_A_SHEET + 1))
        save_png(sheets[-1], contact_sheet(images, math.ceil(math.sqrt(len(images)))))
    remove_sheets(folder, start=len(sheets) + 1)
    return sheets


def remove_sheets(folder: Path, *, start: int = 1) -> None:
    """Take the contact sheets of an earlier run away.

    Parameters
    ----------
    folder : Path
        Of the batch.
    start : int
        Number of the first sheet to go.

    Raises
    ------
    FileError
        A sheet cannot be removed.
    """
    old = list(takewhile(Path.exists, (_sheet(folder, number) for number in count(start))))
    for sheet in reversed(old):  # the first one last: wherever this ends, the rest is found again
        remove_files(sheet, ())


def _sheet(folder: Path, number: int) -> Path:
    return folder / f"contact_sheet{'' if number == 1 else f'_{number}'}.png"
