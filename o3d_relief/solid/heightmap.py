"""Height fields to 16 bit grey pictures, which carving programs read: PNG and TIFF."""

from __future__ import annotations

import json
from io import BytesIO
from pathlib import Path

import numpy as np
from PIL import Image
from PIL.PngImagePlugin import PngInfo
from PIL.TiffImagePlugin import IFDRational, ImageFileDirectory_v2

from o3d_relief.errors import FileError
from o3d_relief.files import check_place, write_bytes
from o3d_relief.param_checks import check_kind
from o3d_relief.solid.heights import HeightField

__all__ = ["HEIGHT_MAPS", "check_height_map", "encode_height_map", "height_map_scale", "write_height_map"]

HEIGHT_MAPS = (".png", ".tif", ".tiff")
"""The file endings that `write_height_map` writes."""

_WHITE = 65535
_DESCRIPTION, _SOFTWARE, _X_RESOLUTION, _Y_RESOLUTION, _RESOLUTION_UNIT = 270, 305, 282, 283, 296
_CENTIMETRE = 3


def check_height_map(path: str | Path) -> None:
    """Check, before any long work, that a height map can be written to a file.

    Parameters
    ----------
    path : str or Path

    Raises
    ------
    FileError
        An ending that cannot be written, or a place where nothing can be written.

    Examples
    --------
    >>> check_height_map("relief.png")
    """
    path = Path(path)
    if path.suffix.lower() not in HEIGHT_MAPS:
        raise FileError(f"{path} cannot be written: its ending must be one of {', '.join(HEIGHT_MAPS)}.")
    check_place(path)


def write_height_map(path: str | Path, field: HeightField) -> None:
    """Write a height field as a 16 bit grey PNG or TIFF, by the file's ending.

    Black is the back of the piece and what lies beside it, white its highest point; in between height is
    linear in the grey level. The file says how large a pixel and a grey level are (see
    `height_map_scale`). The same field gives the same bytes; the file appears whole or not at all.

    Parameters
    ----------
    path : str or Path
    field : HeightField

    Raises
    ------
    FileError
        The file cannot be written.
    ParameterError
        `field` is no HeightField.
    """
    check_kind("field", field, HeightField, "height_field")
    check_height_map(path)
    write_bytes(path, encode_height_map(field, tiff=Path(path).suffix.lower() != ".png"))


def height_map_scale(field: HeightField) -> dict[str, float]:
    """Tell what the pixels and grey levels of a height map mean.

    Parameters
    ----------
    field : HeightField

    Returns
    -------
    dict of str to float
        ``mm_per_pixel``, ``mm_per_grey_level``, and the height of black above the relief plane,
        ``z_of_black_mm``.
    """
    return {
        "mm_per_pixel": field.mm_per_pixel,
        "mm_per_grey_level": (float(np.nanmax(field.z)) - field.back) / _WHITE,
        "z_of_black_mm": field.back,
    }


def encode_height_map(field: HeightField, *, tiff: bool) -> bytes:
    """Write a height map to bytes.

    The scale is in the text chunks of a PNG, and as JSON in the description of a TIFF. The size of a pixel
    is also in the chunk pHYs (in whole pixels per metre) and in the tags XResolution and YResolution (in
    pixels per centimetre), where programs look for it.

    Parameters
    ----------
    field : HeightField
    tiff : bool
        TIFF, without compression; PNG otherwise.

    Returns
    -------
    bytes
        The file.
    """
    scale = height_map_scale(field)
    levels = np.rint((field.z - field.back) / scale["mm_per_grey_level"])
    grey = np.where(field.inside, np.clip(levels, 0, _WHITE), 0).astype(np.uint16)
    picture = Image.fromarray(grey)
    stream = BytesIO()
    if tiff:
        tags = ImageFileDirectory_v2()
        tags[_DESCRIPTION] = json.dumps(scale)
        tags[_SOFTWARE] = "o3d-relief"
        tags[_X_RESOLUTION] = tags[_Y_RESOLUTION] = IFDRational(10.0 / field.mm_per_pixel)
        tags[_RESOLUTION_UNIT] = _CENTIMETRE
        picture.save(stream, format="TIFF", tiffinfo=tags)
    else:
        text = PngInfo()
        text.add_text("Software", "o3d-relief")
        for name, value in scale.items():
            text.add_text(name, repr(float(value)))
        dots_per_inch = 25.4 / field.mm_per_pixel
        picture.save(stream, format="PNG", pnginfo=text, dpi=(dots_per_inch, dots_per_inch))
    return stream.getvalue()
