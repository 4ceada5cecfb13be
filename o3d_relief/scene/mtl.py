"""The materials of an OBJ file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from o3d_relief.scene.arrays import WHITE
from o3d_relief.scene.text import decode_text

__all__ = ["Dress", "Material", "decode_mtl", "dress_faces"]

Color = tuple[float, float, float]


@dataclass(frozen=True)
class Material:
    """A material: its colour from 0 to 1 and the name of its texture, each None where it is not given."""

    color: Color | None = None
    texture: str | None = None


@dataclass(frozen=True, kw_only=True)
class Dress:
    """How faces are coloured: by textures, or all in one colour, or (all None) not at all.

    ids (f,) int64 or None: the texture of each face; textures; color of all vertices or None; missing:
    names of textures that could not be read.
    """

    ids: NDArray[np.int64] | None = None
    textures: tuple[NDArray[np.uint8], ...] = ()
    color: Color | None = None
    missing: tuple[str, ...] = ()


def decode_mtl(data: bytes) -> dict[str, Material]:
    """Read a material library.

    Parameters
    ----------
    data : bytes
        The file. What is not a colour (Kd) or its texture (map_Kd) is left out.

    Returns
    -------
    dict of str to Material
        By name.

    Examples
    --------
    >>> decode_mtl(b"newmtl red" + bytes([10]) + b"Kd 1 0 0")
    {'red': Material(color=(1.0, 0.0, 0.0), texture=None)}
    """
    materials: dict[str, Material] = {}
    name = ""
    for line in decode_text(data).splitlines():
        key, rest = [*line.split(None, 1), "", ""][:2]
        rest = rest.strip()
        if key.lower() == "newmtl":
            name = rest
            materials[name] = Material()
        elif name and key.lower() == "kd":
            materials[name] = Material(_to_color(rest), materials[name].texture)
        elif name and key.lower() == "map_kd" and rest:
            texture = rest.split()[-1] if rest.startswith("-") else rest
            materials[name] = Material(materials[name].color, texture)
    return materials


def _to_color(text: str) -> Color | None:
    try:
        red, green, blue = map(float, text.split())
    except ValueError:  # a spectrum or a colour space, which nobody writes
        return None
    return (red, green, blue)


def dress_faces(
    names: list[str],
    materials: dict[str, Material],
    has_uvs: bool,
    read_texture: Callable[[str], NDArray[np.uint8] | None],
) -> Dress:
    """Find the texture of each face, or the one colour of all of them.

    Parameters
    ----------
    names : list of str
        The material of each face; "" or an unknown one: white.
    materials : dict of str to Material
        By name.
    has_uvs : bool
        Whether the faces have texture coordinates; if not, textures are left out.
    read_texture : callable
        Gives the texture of a file name, or None.

    Returns
    -------
    Dress
        Textures where a material has one or the colours differ (a pixel each), else the colour.

    Examples
    --------
    >>> red = {"red": Material((1.0, 0.0, 0.0))}
    >>> dress_faces(["red", "red"], red, False, lambda name: None).color
    (1.0, 0.0, 0.0)
    """
    used = list(dict.fromkeys(names))
    slots: dict[str | Color | None, int] = {}
    textures: list[NDArray[np.uint8]] = []
    slot_of = {}
    missing: list[str] = []
    pictures = 0
    for name in used:
        material = materials.get(name, Material())
        picture = read_texture(material.texture) if material.texture and has_uvs else None
        if picture is None and material.texture and has_uvs:
            missing.append(material.texture)
        key = material.color if picture is None else material.texture
        if key not in slots:
            slots[key] = len(textures)
            textures.append(_to_pixel(material.color) if picture is None else picture)
            pictures += picture is not None
        slot_of[name] = slots[key]
    if pictures == 0 and len(slots) <= 1:
        color = next(iter(slots), None)
        return Dress(color=None if isinstance(color, str) else color, missing=tuple(missing))
    ids = np.array([slot_of[name] for name in names], dtype=np.int64)
    return Dress(ids=ids, textures=tuple(textures), missing=tuple(missing))


def _to_pixel(color: Color | None) -> NDArray[np.uint8]:
    if color is None:
        return WHITE
    return np.rint(255.0 * np.clip([[color]], 0.0, 1.0)).astype(np.uint8)
