"""Solids to 3MF: millimetres, colours, the same bytes for the same solids."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from io import BytesIO

import numpy as np
from numpy.typing import NDArray

from o3d_relief.solid.body import Solid

__all__ = ["encode_3mf"]

_CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
_MATERIAL = "http://schemas.microsoft.com/3dmanufacturing/material/2015/02"
_MODEL = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"
_PACKAGE = "http://schemas.openxmlformats.org/package/2006"
_HEAD = '<?xml version="1.0" encoding="UTF-8"?>\n'
_CONTENT_TYPES = (
    f'{_HEAD}<Types xmlns="{_PACKAGE}/content-types">'
    f'<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    f'<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>'
    "</Types>\n"
)
_RELATIONSHIPS = (
    f'{_HEAD}<Relationships xmlns="{_PACKAGE}/relationships">'
    f'<Relationship Target="/3D/3dmodel.model" Id="rel0" Type="{_MODEL}"/></Relationships>\n'
)


def encode_3mf(solids: Mapping[str, Solid]) -> bytes:
    """Write a 3MF: one object for each solid, in millimetres, with the colours of the faces' corners.

    3MF Core 1.3, and the colour groups of the Materials and Properties extension where a solid has
    colours. Coordinates are those of the solids in float32, all of its digits; each object is placed with
    its least corner at the origin of the printing bed.

    Parameters
    ----------
    solids : mapping of str to Solid
        By the name of the object.

    Returns
    -------
    bytes
        The file: a ZIP archive without time stamps.

    Examples
    --------
    >>> corner = Solid(vertices=np.eye(3), faces=np.array([[0, 1, 2]]), is_plate=np.zeros(1, dtype=bool))
    >>> encode_3mf({"corner": corner})[:2]
    b'PK'
    """
    lines = [
        f'{_HEAD}<model unit="millimeter" xml:lang="en-US" xmlns="{_CORE}" xmlns:m="{_MATERIAL}">',
        '<metadata name="Application">o3d-relief</metadata>',
        "<resources>",
    ]
    items = []
    for number, (name, solid) in enumerate(solids.items()):
        colors, objects = 2 * number + 1, 2 * number + 2
        lines += _resources(name, solid, colors, objects)
        x, y, z = -solid.vertices.min(axis=0) + 0.0
        items.append(f'<item objectid="{objects}" transform="1 0 0 0 1 0 0 0 1 {x:.9g} {y:.9g} {z:.9g}"/>')
    lines += ["</resources>", "<build>", *items, "</build>", "</model>\n"]
    return _archive(
        {
            "[Content_Types].xml": _CONTENT_TYPES,
            "_rels/.rels": _RELATIONSHIPS,
            "3D/3dmodel.model": "\n".join(lines),
        }
    )


def _resources(name: str, solid: Solid, colors: int, objects: int) -> list[str]:
    """Return the colour group, where there is one, and the object: the numbers are their ids."""
    vertices = _rows('<vertex x="%.9g" y="%.9g" z="%.9g"/>', solid.vertices.astype(np.float32))
    title = f'id="{objects}" type="model" name="{_escape(name)}"'
    if solid.colors is None:
        group = []
        triangles = _rows('<triangle v1="%d" v2="%d" v3="%d"/>', solid.faces)
    else:
        palette, index = _palette(solid)
        group = [
            f'<m:colorgroup id="{colors}">',
            _rows('<m:color color="#%06X"/>', palette),
            "</m:colorgroup>",
        ]
        title += f' pid="{colors}" pindex="0"'
        triangles = _rows(
            f'<triangle v1="%d" v2="%d" v3="%d" pid="{colors}" p1="%d" p2="%d" p3="%d"/>',
            np.hstack([solid.faces, index]),
        )
    return [
        *group,
        f"<object {title}>",
        "<mesh>",
        "<vertices>",
        vertices,
        "</vertices>",
        "<triangles>",
        triangles,
        "</triangles>",
        "</mesh>",
        "</object>",
    ]


def _palette(solid: Solid) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the different colours (c, 1) as 0xRRGGBB and, for each corner (m, 3), which it has."""
    levels = np.rint(255.0 * np.clip(solid.corner_colors(), 0.0, 1.0)).astype(np.int64)
    palette, index = np.unique(levels @ np.array([65536, 256, 1]), return_inverse=True)
    return palette[:, None], index.reshape(-1, 3)


def _rows(template: str, values: NDArray[np.generic]) -> str:
    """Fill the template with each row of values (n, columns)."""
    return ("\n".join([template] * len(values))) % tuple(values.ravel().tolist())


def _escape(text: str) -> str:
    kept = "".join(letter for letter in text if letter.isprintable())
    return kept.replace("&", "&amp;").replace("<", "&lt;").replace('"', "&quot;")


def _archive(files: dict[str, str]) -> bytes:
    stream = BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        for name, text in files.items():
            info = zipfile.ZipInfo(name)  # its date is the earliest that ZIP knows
            info.compress_type = zipfile.ZIP_DEFLATED
            info.create_system = 3  # the same on every system
            info.external_attr = 0o644 << 16
            archive.writestr(info, text)
    return stream.getvalue()
