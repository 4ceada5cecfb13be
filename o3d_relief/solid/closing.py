"""From open surfaces to closed ones: down to the plate, and caps over holes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from o3d_relief.solid.chain import boundary, loops
from o3d_relief.solid.pieces import Piece

__all__ = ["capped", "caps", "lowered"]


def lowered(piece: Piece, edges: NDArray[np.int64], floor: float) -> Piece:
    """Continue a surface straight down from edges of its boundary.

    Parameters
    ----------
    piece : Piece
    edges : (b, 2) int64
        In the direction of their faces.
    floor : float
        z at which the walls end, in millimetres.

    Returns
    -------
    Piece
        With a wall below each edge.
    """
    top, ends = np.unique(edges, return_inverse=True)
    places = piece.vertices[top].copy()
    places[:, 2] = floor
    below = len(piece.vertices) + ends.reshape(-1, 2)
    (a, b), (c, d) = edges.T, below.T  # c below a, d below b
    walls = np.concatenate([np.stack([b, a, c], axis=1), np.stack([b, c, d], axis=1)])
    return piece.with_copies(top, places).with_faces(walls)


def caps(piece: Piece, edges: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Close a boundary with faces on its own vertices.

    Loops that lie in one horizontal plane below S are closed together (one may be a hole in another), all
    others one by one, as seen along the normal of the plane that fits them best.

    Parameters
    ----------
    piece : Piece
    edges : (b, 2) int64
        The whole boundary, in the direction of the faces.

    Returns
    -------
    bottom : (p, 3) int64
        Faces that close what ends at the lowest z, below S.
    air : (q, 3) int64
        All others.
    """
    floor = piece.vertices[:, 2].min()
    at_floor: list[NDArray[np.int64]] = []
    in_air: list[NDArray[np.int64]] = []
    for loop in loops(edges):
        z = piece.vertices[loop, 2]
        (at_floor if floor < 0.0 and (z == floor).all() else in_air).append(loop[::-1])
    # The triangulation takes outlines that run anticlockwise; these are seen from below.
    bottom = _filled([piece.vertices[loop, :2] * (-1.0, 1.0) for loop in at_floor], at_floor)
    air = [_filled([_flat(piece.vertices[loop])], [loop]) for loop in in_air]
    return bottom, np.concatenate([np.zeros((0, 3), dtype=np.int64), *air])


def capped(piece: Piece) -> Piece:
    """Close every hole of a mesh.

    Examples
    --------
    >>> corner = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    >>> open_corner = Piece(
    ...     vertices=corner, faces=np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3]]), source=np.arange(4)
    ... )
    >>> capped(open_corner).faces[3:].tolist()
    [[3, 2, 0]]
    """
    return piece.with_faces(*caps(piece, boundary(piece.faces)))


def _filled(outlines: list[NDArray[np.float64]], numbers: list[NDArray[np.int64]]) -> NDArray[np.int64]:
    import manifold3d

    if not outlines:
        return np.zeros((0, 3), dtype=np.int64)
    triangles = np.asarray(manifold3d.triangulate(outlines), dtype=np.int64).reshape(-1, 3)
    return np.asarray(np.concatenate(numbers)[triangles])


def _flat(loop: NDArray[np.float64]) -> NDArray[np.float64]:
    """Look at a loop (l, 3) against its Newell normal: (l, 2), running anticlockwise."""
    following = np.roll(loop, -1, axis=0)
    middle = loop.mean(axis=0)
    normal = np.cross(loop - middle, following - middle).sum(axis=0)
    length = float(np.linalg.norm(normal))
    normal = normal / length if length > 0.0 else np.array([0.0, 0.0, 1.0])
    right = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    right /= np.linalg.norm(right)
    return np.asarray((loop - middle) @ np.stack([right, np.cross(normal, right)], axis=1))
