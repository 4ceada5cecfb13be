"""The room behind an open surface, filled: from what the viewer sees straight back to the next air.

On every line along z the surface is met from the front. Where it is entered, solid begins, where it is left
through a face that turns to the back, air does. What is missing of a scan is mostly its back: an entry that
no exit follows is solid as far as the plate. An entry into what is solid already and an exit out of air tell
nothing: such faces are left out. The wrong side of a sheet is entered if it is what the viewer sees.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from o3d_relief.rays import unit_box
from o3d_relief.solid.chain import boundary
from o3d_relief.solid.halving import halved
from o3d_relief.solid.outlines import once_covered
from o3d_relief.solid.pieces import Piece

__all__ = ["Lines", "filled_behind", "followed"]

_ROUNDS = 2
"""How often faces of which a part is left out are split in four, before each is kept or left out."""
_PLACES = 4
"""Lines through each face."""
_CORNER = 0.9
"""All but one of them lie this far towards a corner."""
_FACES_AT_ONCE = 250_000


def filled_behind(piece: Piece, floor: float) -> list[Piece]:
    """Close an open surface by what is straight behind it.

    Parameters
    ----------
    piece : Piece
        Nothing of it at or below the floor.
    floor : float
        z below S where what no exit follows ends, in millimetres.

    Returns
    -------
    list of Piece
        Without boundary; their union is meant. The faces are those of the surface, but for what is left out,
        upright walls and the floor.
    """
    piece = piece.only(piece.area_normals()[:, 2] != 0.0)
    if len(piece.faces) == 0:  # it stands upright all over: nothing is behind it
        return []
    lines = followed(piece)
    for _ in range(_ROUNDS):
        torn = lines.torn
        if not torn.any():
            break
        piece, source = _split(piece, torn)
        again = np.flatnonzero(torn[source])
        lines = lines.of(source).replaced(again, followed(piece, again))
    wrong = (lines.entered > 0) & (piece.area_normals()[:, 2] < 0.0)
    piece = Piece(
        vertices=piece.vertices,
        faces=np.where(wrong[:, None], piece.faces[:, ::-1], piece.faces),
        source=piece.source,
    )
    whole = np.flatnonzero((lines.kept == _PLACES) & ~lines.torn)
    whole = whole[once_covered(piece.vertices, piece.faces[whole])]
    # Between what hides something and what is left of that is a gap as wide as the faces that were split.
    left = np.ones(len(piece.faces), dtype=bool)
    left[whole] = False
    rest = np.flatnonzero(left & (lines.entered > 0) & (lines.founded == _PLACES))
    rest = rest[once_covered(piece.vertices, piece.faces[rest])]
    return [_on_floor(piece.only(rows), floor) for rows in (whole, rest) if len(rows)]


def _on_floor(top: Piece, floor: float) -> Piece:
    """Continue a surface straight down to the floor, and close it there with a copy of itself."""
    count = len(top.vertices)
    below = top.vertices.copy()
    below[:, 2] = floor
    edges = boundary(top.faces)
    (a, b), (c, d) = edges.T, (edges + count).T
    walls = np.concatenate([np.stack([b, a, c], axis=1), np.stack([b, c, d], axis=1)])
    return top.with_copies(np.arange(count), below).with_faces(top.faces[:, ::-1] + count, walls)


@dataclass(frozen=True, kw_only=True, eq=False)
class Lines:
    """What four lines through each face have met.

    Attributes
    ----------
    kept : (m,) int64
        On how many of them the face separates what is solid from air.
    entered : (m,) int64
        On how many of these the solid lies behind it.
    founded : (m,) int64
        On how many no exit comes behind it.
    """

    kept: NDArray[np.int64]
    entered: NDArray[np.int64]
    founded: NDArray[np.int64]

    @property
    def torn(self) -> NDArray[np.bool_]:
        """(m,) bool: faces whose lines do not agree."""
        agree = ((self.kept == 0) | (self.kept == _PLACES)) & (
            (self.entered == 0) | (self.entered == self.kept)
        )
        return np.asarray(~agree)

    def of(self, rows: NDArray[np.int64]) -> Lines:
        """Return the numbers of some faces."""
        return Lines(kept=self.kept[rows], entered=self.entered[rows], founded=self.founded[rows])

    def replaced(self, rows: NDArray[np.int64], new: Lines) -> Lines:
        """Return all numbers, those of some faces new."""
        result = {}
        for name in ("kept", "entered", "founded"):
            values = getattr(self, name).copy()
            values[rows] = getattr(new, name)
            result[name] = values
        return Lines(**result)


def followed(piece: Piece, rows: NDArray[np.int64] | None = None) -> Lines:
    """Follow lines along z through faces.

    Parameters
    ----------
    piece : Piece
        No face of it stands upright.
    rows : (q,) int64, optional
        The faces that are asked for; all where omitted.

    Returns
    -------
    Lines

    Examples
    --------
    >>> steps = np.array([[0, 0], [4, 0], [0, 4.0]])
    >>> points = np.concatenate([np.column_stack([steps, [z] * 3]) for z in (3.0, 2.0, 1.0)])
    >>> sheets = Piece(vertices=points, faces=np.arange(9).reshape(3, 3), source=np.arange(9))
    >>> followed(sheets).kept.tolist()
    [4, 0, 0]
    """
    rows = np.arange(len(piece.faces)) if rows is None else rows
    scene, middle, size = unit_box(piece.vertices, piece.faces)
    upward = piece.area_normals()[:, 2] > 0.0
    counts = [np.zeros((3, 0), dtype=np.int64)]
    for start in range(0, len(rows), _FACES_AT_ONCE):
        some = rows[start : start + _FACES_AT_ONCE]
        corners = (piece.vertices[piece.faces[some]] - middle) / size
        counts.append(_crossings(scene, corners, some, upward))
    kept, entered, founded = np.concatenate(counts, axis=1)
    return Lines(kept=kept, entered=entered, founded=founded)


def _crossings(
    scene: o3d.t.geometry.RaycastingScene,
    corners: NDArray[np.float64],
    rows: NDArray[np.int64],
    upward: NDArray[np.bool_],
) -> NDArray[np.int64]:
    """Follow lines through the faces `rows`, whose corners (q, 3, 3) these are: (3, q), as in `Lines`."""
    weights = np.full((_PLACES, 3), 1.0 / 3.0)
    weights[1:] = (1.0 - _CORNER) / 2.0 + (1.5 * _CORNER - 0.5) * np.eye(3)
    points = np.einsum("pc,qcd->qpd", weights, corners).reshape(-1, 3)
    top = np.column_stack([points[:, :2], np.ones(len(points))])
    rays = np.concatenate([top, np.tile([0.0, 0.0, -1.0], (len(top), 1))], axis=1).astype(np.float32)
    hits = scene.list_intersections(o3d.core.Tensor(rays))
    own = np.repeat(rows, _PLACES)
    line = hits["ray_ids"].numpy().astype(np.int64)
    face = hits["primitive_ids"].numpy().astype(np.int64)
    # A line's own face is met exactly where it was aimed at, also where float32 misses a sliver.
    others = face != own[line]
    line = np.concatenate([line[others], np.arange(len(own))])
    face = np.concatenate([face[others], own])
    way = np.concatenate([hits["t_hit"].numpy().astype(np.float64)[others], 1.0 - points[:, 2]])
    order = np.lexsort((face, way, line))
    line, face = line[order], face[order]
    first = np.concatenate([[True], line[1:] != line[:-1]])
    entering = upward[face] | first
    before = np.concatenate([[False], entering[:-1]])
    kept = first | (entering != before)
    exits = np.cumsum(kept & ~entering)
    last = np.append(np.flatnonzero(first)[1:] - 1, len(line) - 1)
    mine = face == own[line]
    founded = mine & (exits == exits[last][line])
    return np.stack(
        [
            np.bincount(line[which] // _PLACES, minlength=len(rows))
            for which in (mine & kept, mine & kept & entering, founded)
        ]
    )


def _split(piece: Piece, torn: NDArray[np.bool_]) -> tuple[Piece, NDArray[np.int64]]:
    """Split faces in four, and their neighbours so that they still meet; with the face each lies in."""
    ends = np.stack([piece.faces, np.roll(piece.faces, -1, axis=1)], axis=2)
    key = ends.min(axis=2) * len(piece.vertices) + ends.max(axis=2)
    split = halved(piece.faces, np.isin(key, key[torn]), len(piece.vertices))
    first, second = split.pairs.T
    places = (piece.vertices[first] + piece.vertices[second]) / 2.0
    finer = piece.with_copies(first, places)
    return Piece(vertices=finer.vertices, faces=split.faces, source=finer.source), split.source
