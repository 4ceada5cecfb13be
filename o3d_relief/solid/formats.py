"""Solids to files that slicers and mills take: STL, 3MF, OBJ, PLY, GLB."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from o3d_relief.errors import FileError
from o3d_relief.files import check_place, write_files
from o3d_relief.param_checks import check_kind
from o3d_relief.scene.arrays import MeshArrays
from o3d_relief.scene.encode import encode_mesh
from o3d_relief.solid.body import PLATE_COLOR, Solid
from o3d_relief.solid.distinct import distinct
from o3d_relief.solid.threemf import encode_3mf

__all__ = ["SOLID_WRITABLE", "check_solid_writable", "write_solid", "write_solids"]

SOLID_WRITABLE = (".3mf", ".stl", ".ply", ".obj", ".glb")
"""The file endings that `write_solid` writes."""


def check_solid_writable(path: str | Path) -> None:
    """Check, before any long work, that a solid can be written to a file.

    Parameters
    ----------
    path : str or Path
        The file to be written. It may exist already: it will be replaced.

    Raises
    ------
    FileError
        An ending that cannot be written, a folder in place of a file, a folder that is missing or in
        which nothing can be written.
    """
    path = Path(path)
    if path.suffix.lower() not in SOLID_WRITABLE:
        raise FileError(f"{path} cannot be written: its ending must be one of {', '.join(SOLID_WRITABLE)}.")
    check_place(path)


def write_solid(path: str | Path, solid: Solid) -> None:
    """Write a solid as 3MF, STL, PLY, OBJ or GLB, by the file's ending, in millimetres.

    3MF states its unit and keeps the colour of every corner. PLY, OBJ and GLB keep the colours of the
    vertices; a vertex where the colours of relief and plate meet is there twice. STL has no colours. GLB
    is in metres, as the format demands. No two vertices lie at one place, whatever the format (see
    `distinct`). The same solid gives the same bytes; the file appears whole or not at all.

    Parameters
    ----------
    path : str or Path
        The file; it is replaced if it exists.
    solid : Solid

    Raises
    ------
    FileError
        The file cannot be written.
    ParameterError
        `solid` is no Solid.
    MeshError
        A solid whose detail float32 cannot hold.
    """
    check_kind("solid", solid, Solid, "make_solid")
    write_solids(path, {Path(path).name: solid})


def write_solids(path: str | Path, solids: Mapping[str, Solid]) -> None:
    """Write several solids into one folder, each as a file of its own: all or nothing.

    Parameters
    ----------
    path : str or Path
        The main file, for its folder and for messages.
    solids : mapping of str to Solid
        By file name; the main one last.

    Raises
    ------
    FileError
        A file cannot be written.
    MeshError
        A solid whose detail float32 cannot hold.
    """
    check_solid_writable(path)
    files: dict[str, bytes] = {}
    for name, solid in solids.items():
        files |= _encode(Path(name), solid)
    write_files(path, files)


def _encode(path: Path, solid: Solid) -> dict[str, bytes]:
    ending = path.suffix.lower()
    solid = distinct(solid)
    if ending == ".3mf":
        return {path.name: encode_3mf({path.stem: solid})}
    if ending == ".stl":
        return encode_mesh(MeshArrays(vertices=solid.vertices, faces=solid.faces), path.name)
    arrays = _colored_arrays(solid)
    if ending == ".glb":
        arrays = replace(arrays, vertices=0.001 * arrays.vertices)
    return encode_mesh(arrays, path.name)


def _colored_arrays(solid: Solid) -> MeshArrays:
    """Give every vertex one colour: those at a seam of colours become two."""
    if solid.colors is None:
        return MeshArrays(vertices=solid.vertices, faces=solid.faces)
    used, corners = np.unique(2 * solid.faces + solid.is_plate[:, None], return_inverse=True)
    place = used // 2
    colors = np.where((used % 2 == 1)[:, None], PLATE_COLOR, solid.colors[place])
    return MeshArrays(vertices=solid.vertices[place], faces=corners.reshape(-1, 3), colors=colors)
