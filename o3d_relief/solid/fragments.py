"""What a cut leaves without hold: parts of a tile that only the neighbouring tile holds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from o3d_relief.solid.joints import box

if TYPE_CHECKING:
    import manifold3d

__all__ = ["Cell", "held"]

Cell = tuple[int, int]
"""Column and row of a tile."""

_TOUCH = 0.01
"""Millimetres around a part in which its neighbour is looked at."""


def held(
    bodies: Mapping[Cell, manifold3d.Manifold], back: float, largest: tuple[float, float]
) -> tuple[dict[Cell, manifold3d.Manifold], int]:
    """Give every part that does not reach the back to the neighbouring tile that holds it.

    An arm in front of a joint may come back into the tile that it starts from; the piece in between would
    be a loose chip.

    Parameters
    ----------
    bodies : mapping of Cell to manifold3d.Manifold
    back : float
        z of the flat back.
    largest : (width, height)
        What a tile may measure, in millimetres.

    Returns
    -------
    bodies : dict of Cell to manifold3d.Manifold
        Tiles of which nothing is left are missing.
    loose : int
        Parts that no tile holds, or that would make it too large: they stay where they are.
    """
    tiles: dict[Cell, list[manifold3d.Manifold]] = {}
    waiting: list[tuple[Cell, manifold3d.Manifold]] = []
    for cell, body in bodies.items():
        for part in body.decompose():
            if part.bounding_box()[2] <= back + 1e-6:
                tiles.setdefault(cell, []).append(part)
            else:
                waiting.append((cell, part))
    while True:
        left = [(cell, part) for cell, part in waiting if not _given(part, tiles, largest)]
        if len(left) == len(waiting):
            break
        waiting = left
    for cell, part in left:
        tiles.setdefault(cell, []).append(part)
    return {cell: _united(tiles[cell]) for cell in bodies if cell in tiles}, len(left)


def _given(
    part: manifold3d.Manifold,
    tiles: dict[Cell, list[manifold3d.Manifold]],
    largest: tuple[float, float],
) -> bool:
    """Give a part to the first tile that it touches and fits."""
    bounds = np.array(part.bounding_box())
    low, high = bounds[:3] - _TOUCH, bounds[3:] + _TOUCH
    near = box(low, high)
    for bodies in tiles.values():
        if not _fits([part, *bodies], largest):
            continue
        for body in bodies:
            other = np.array(body.bounding_box())
            if (other[:3] > high).any() or (other[3:] < low).any():
                continue
            local = body ^ near
            if not local.is_empty() and len((local + part).decompose()) <= len(local.decompose()):
                bodies.append(part)
                return True
    return False


def _fits(parts: list[manifold3d.Manifold], largest: tuple[float, float]) -> bool:
    bounds = np.array([part.bounding_box() for part in parts])
    extents = bounds[:, 3:].max(axis=0) - bounds[:, :3].min(axis=0)
    return bool((extents[:2] <= largest).all())


def _united(parts: list[manifold3d.Manifold]) -> manifold3d.Manifold:
    import manifold3d

    return manifold3d.Manifold.batch_boolean(parts, manifold3d.OpType.Add)
