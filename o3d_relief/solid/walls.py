"""Walls that are too thin, made thicker at their back, where the viewer does not see it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from o3d_relief.solid.body import Solid, manifold_of
from o3d_relief.solid.measures import wall_thickness
from o3d_relief.solid.pieces import Piece
from o3d_relief.solid.thicken import shells

if TYPE_CHECKING:
    import manifold3d

__all__ = ["with_thicker_walls"]

_TOWARDS = (0.02, 0.03, 1.0)
"""Of the two sides of a wall, the one that turns this way keeps its place: to the viewer, and never both."""
_EXTRA = 1.02
"""Walls get this much more than they need: they are measured in float32."""


def with_thicker_walls(solid: Solid, thinnest: float) -> manifold3d.Manifold:
    """Unite a solid with shells behind the surfaces whose walls are too thin.

    Parameters
    ----------
    solid : Solid
    thinnest : float
        Wanted thickness in millimetres. Gaps behind a thin wall that are smaller than what it lacks close.

    Returns
    -------
    manifold3d.Manifold
        Within the extents of the solid; what turns to the viewer is where it was.
    """
    import manifold3d

    body = solid.to_manifold()
    piece = Piece(vertices=solid.vertices, faces=solid.faces, source=np.arange(len(solid.vertices)))
    thin = (wall_thickness(solid) < thinnest) & ~solid.is_plate & (piece.area_normals() @ _TOWARDS > 0.0)
    if not thin.any():
        return body
    white = np.ones((1, 3))
    added = [
        manifold_of(
            shell.vertices,
            shell.faces,
            colors=white if solid.colors is None else solid.colors[shell.source],
            is_plate=False,
        )
        for shell in shells(piece.only(thin), _EXTRA * thinnest, leave_room=False)
    ]
    low, high = solid.vertices.min(axis=0), solid.vertices.max(axis=0)
    box = _box(low, high)
    backs = manifold3d.Manifold.batch_boolean(added, manifold3d.OpType.Add)
    return body + (backs ^ box)


def _box(low: NDArray[np.float64], high: NDArray[np.float64]) -> manifold3d.Manifold:
    import manifold3d

    return manifold3d.Manifold.cube(tuple(high - low)).translate(tuple(low))
