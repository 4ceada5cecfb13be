"""The parts of a relief, each as one or more closed meshes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from o3d_relief.scene.weld import first_of_equal_rows
from o3d_relief.solid.chain import (
    boundary,
    edge_components,
    one_of_each,
    separate_parts,
    volume,
    without_opposites,
)
from o3d_relief.solid.closing import caps, lowered
from o3d_relief.solid.filling import filled_behind
from o3d_relief.solid.orient import oriented
from o3d_relief.solid.pieces import Piece
from o3d_relief.solid.thicken import charts, shells

__all__ = ["ClosedParts", "closed_parts"]

_CAP_SHARE = 0.5
"""A hole is closed if the caps have at most this share of the part's own area: that of a half ball."""
_CAP_SEEN = 0.05
"""... and make up at most this share of what the viewer sees of it."""
_HEIGHT_FIELD = 0.95
"""A surface counts as a height field if its faces turn to the viewer but for this share."""
_MOST_CHARTS = 100
"""What falls into more nearly flat pieces is too rough for a wall of even thickness behind it."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ClosedParts:
    """What became of the parts.

    Attributes
    ----------
    pieces : tuple of Piece
        Each without boundary and with positive volume.
    counts : dict of str to int
        Parts that were closed already (but for their foot), capped, closed towards the plate, filled from
        behind, thickened, and left out because they have no volume.
    """

    pieces: tuple[Piece, ...]
    counts: dict[str, int]


def closed_parts(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], *, floor: float, thickness: float
) -> ClosedParts:
    """Close the parts of a trimmed relief.

    A part that ends at S only goes on straight down to the floor and is closed there. Of the others, one that
    lacks little is capped; a height field is closed towards the plate; what is rough, as scans are, is filled
    from its faces back to the next air; anything else gets thickness.

    Parameters
    ----------
    vertices : (n, 3) float64
        In millimetres, nothing behind S, the foot at z = 0 exactly.
    faces : (m, 3) int64
    floor : float
        z below S where what is closed towards the plate ends.
    thickness : float
        For surfaces that have none, in millimetres.

    Returns
    -------
    ClosedParts
    """
    piece, turned = oriented(_cleaned(vertices, faces))
    edges = boundary(piece.faces)
    foot = (piece.vertices[edges, 2] == 0.0).all(axis=1)
    piece = lowered(piece, edges[foot], floor)
    part = separate_parts(piece.faces)
    order = np.argsort(part, kind="stable")
    pieces: list[Piece] = []
    counts = {"closed": 0, "capped": 0, "to_the_plate": 0, "filled": 0, "thickened": 0}
    counts["without_volume"] = 0
    counts["faces_turned"] = turned
    for rows in np.split(order, np.flatnonzero(np.diff(part[order])) + 1):
        how, closed = _closed(piece.only(np.sort(rows)), floor, thickness)
        pieces += closed
        counts[how] += 1
    return ClosedParts(pieces=tuple(pieces), counts=counts)


def _cleaned(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> Piece:
    """Weld, and leave out what has no area, is there twice or lies in S."""
    first = first_of_equal_rows(vertices)
    merged = first[faces]
    a, b, c = merged.T
    flat = (vertices[merged, 2] == 0.0).all(axis=1)
    merged = merged[(a != b) & (b != c) & (c != a) & ~flat]
    piece = Piece(vertices=vertices, faces=merged, source=np.arange(len(vertices)))
    once, cancelled = one_of_each(merged), without_opposites(merged)
    if len(once) == len(cancelled):
        return piece.only(once)
    # Two faces on the same vertices, front and back, are a fold that welding has closed where the part
    # has no boundary anyway, and a sheet that was drawn from both sides where little is left without them.
    part = edge_components(merged)
    area = np.linalg.norm(piece.area_normals(), axis=1)
    left = np.bincount(part[cancelled], weights=area[cancelled], minlength=part.max() + 1)
    sheet = left < 0.5 * np.bincount(part[once], weights=area[once])
    return piece.only(np.union1d(once[sheet[part[once]]], cancelled[~sheet[part[cancelled]]]))


def _closed(piece: Piece, floor: float, thickness: float) -> tuple[str, list[Piece]]:
    edges = boundary(piece.faces)
    bottom, air = caps(piece, edges)
    filled = piece.with_faces(bottom, air)
    enclosed = volume(filled.vertices, filled.faces)
    normals = piece.area_normals()
    area = np.linalg.norm(normals, axis=1).sum()
    if len(air) == 0:
        if abs(enclosed) <= 1e-9 * area:
            return "without_volume", []
        return "closed", [filled if enclosed > 0.0 else filled.turned()]
    cap_normals = Piece(vertices=piece.vertices, faces=air, source=piece.source).area_normals()
    cap_area = np.linalg.norm(cap_normals, axis=1).sum()
    seen, own = (np.maximum(part[:, 2], 0.0).sum() for part in (cap_normals, normals))
    if enclosed > 0.0 and cap_area <= _CAP_SHARE * area and seen <= _CAP_SEEN * own:
        return "capped", [filled]
    if normals[:, 2].sum() >= _HEIGHT_FIELD * np.abs(normals[:, 2]).sum() > 0.0:
        open_edges = edges[~(piece.vertices[edges, 2] == floor).all(axis=1)]
        down = lowered(piece, open_edges, floor)
        closed = down.with_faces(*caps(down, boundary(down.faces)))
        if volume(closed.vertices, closed.faces) > 0.0:
            return "to_the_plate", [closed]
    if charts(piece).max() + 1 > _MOST_CHARTS:
        without_foot = piece.only((piece.vertices[piece.faces, 2] > floor).all(axis=1))
        if behind := _with_volume(filled_behind(without_foot, floor)):
            return "filled", behind
    return "thickened", _with_volume(shells(piece, thickness))


def _with_volume(pieces: list[Piece]) -> list[Piece]:
    return [piece for piece in pieces if volume(piece.vertices, piece.faces) > 0.0]
