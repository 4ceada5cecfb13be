"""What a rough surface covers, seen from the front."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from o3d_relief.solid.chain import boundary, loops
from o3d_relief.solid.pieces import Piece

if TYPE_CHECKING:
    import manifold3d

__all__ = ["rough_silhouette"]


def rough_silhouette(pieces: Sequence[Piece], cell: float) -> manifold3d.CrossSection:
    """Return the squares in which vertices lie, and the faces that are larger than these.

    The exact outline of a scan has hundred thousands of corners, and takes minutes.

    Parameters
    ----------
    pieces : sequence of Piece
    cell : float
        Side of the squares, in millimetres: the outline is that far off at most.

    Returns
    -------
    manifold3d.CrossSection

    Examples
    --------
    >>> corner = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]])
    >>> piece = Piece(vertices=corner, faces=np.array([[0, 1, 2]]), source=np.arange(3))
    >>> round(rough_silhouette([piece], 0.01).area(), 2), rough_silhouette([piece], 2.0).area()
    (0.5, 4.0)
    """
    import manifold3d

    low = np.min([piece.vertices[:, :2].min(axis=0) for piece in pieces], axis=0)
    taken = [np.floor((piece.vertices[:, :2] - low) / cell).astype(np.int64) for piece in pieces]
    squares = np.unique(np.concatenate(taken), axis=0)
    count = int(squares.max()) + 2
    corner = squares[:, 0] * count + squares[:, 1]
    quads = np.stack([corner, corner + count, corner + count + 1, corner + 1], axis=1)
    edges = boundary(np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]))
    outlines = [np.stack([loop // count, loop % count], axis=1) * cell + low for loop in loops(edges)]
    for piece in pieces:
        triangles = piece.vertices[piece.faces][:, :, :2]
        (x, y), (u, v) = (triangles[:, 1] - triangles[:, 0]).T, (triangles[:, 2] - triangles[:, 0]).T
        large = (np.ptp(triangles, axis=1).max(axis=1) > cell) & (x * v > y * u)
        outlines += list(triangles[large])
    return manifold3d.CrossSection(outlines, manifold3d.FillRule.Positive)
