"""The reliefs of a batch on one sheet."""

from __future__ import annotations

import math
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from o3d_relief.batch_manifest import PICTURES, BatchEntry

__all__ = ["write_sheets"]

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

    Raises
    ------
    FileError
        A sheet cannot be written.
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
        number = start // _ON_A_SHEET + 1
        sheets.append(folder / f"contact_sheet{'' if number == 1 else f'_{number}'}.png")
        save_png(sheets[-1], contact_sheet(images, math.ceil(math.sqrt(len(images)))))
    return sheets
