"""The files that a mesh file names: materials, textures, the parts of a glTF."""

from __future__ import annotations

import warnings
from io import BytesIO
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from o3d_relief.limits import check_file_size

__all__ = ["NamedFiles", "to_texture"]


class NamedFiles:
    """Finds them; where the folder of a name is unknown here, it looks beside the mesh file.

    Parameters
    ----------
    folder : Path
        Of the mesh file.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def read(self, name: str) -> bytes | None:
        """Read a file, None where there is none."""
        name = name.strip().strip('"').replace("\\", "/")
        for place in (self._folder / name, self._folder / Path(name).name):
            try:
                if place.is_file():  # a device would never end
                    check_file_size(place, place.stat().st_size)
                    return place.read_bytes()
            except (OSError, ValueError):  # one that is too large for the memory, too
                continue
        return None

    def texture(self, name: str) -> NDArray[np.uint8] | None:
        """Read a texture, see `to_texture`; None where there is none."""
        content = self.read(name)
        return None if content is None else to_texture(BytesIO(content))

    def get(self, name: str) -> bytes:
        """Read a file for trimesh, which asks for it as glTF writes its name.

        Raises
        ------
        FileNotFoundError
            There is none.
        """
        content = self.read(name)
        if content is None:
            content = self.read(unquote(name))
        if content is None:
            raise FileNotFoundError(name)
        return content

    __getitem__ = get


def to_texture(source: Any) -> NDArray[np.uint8] | None:
    """Turn a PIL picture, or a stream of one, into a texture (h, w, 3) with its bottom row first.

    None where it cannot be read.
    """
    from PIL import Image

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of Pillow, on odd but readable pictures
        try:
            image = source if isinstance(source, Image.Image) else Image.open(source)
            pixels = np.asarray(image.convert("RGB"))
        except (OSError, SyntaxError, ValueError, Image.DecompressionBombError):
            return None
    return np.ascontiguousarray(pixels[::-1])
