"""A part of a relief on its way to a closed body."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Piece"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Piece:
    """A triangle mesh whose vertices remember which vertex of the relief they come from.

    Attributes
    ----------
    vertices : (n, 3) float64
        In millimetres.
    faces : (m, 3) int64
    source : (n,) int64
        The relief's vertex that gives the colour.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    source: NDArray[np.int64]

    def only(self, rows: NDArray[np.int64] | NDArray[np.bool_]) -> Piece:
        """Keep some faces, and the vertices that they use."""
        used, faces = np.unique(self.faces[rows], return_inverse=True)
        return Piece(vertices=self.vertices[used], faces=faces.reshape(-1, 3), source=self.source[used])

    def with_faces(self, *more: NDArray[np.int64]) -> Piece:
        """Add faces on the vertices that are there."""
        return Piece(vertices=self.vertices, faces=np.concatenate([self.faces, *more]), source=self.source)

    def with_copies(self, index: NDArray[np.int64], places: NDArray[np.float64]) -> Piece:
        """Add copies of vertices (k,) at other places (k, 3), numbered from n on."""
        return Piece(
            vertices=np.concatenate([self.vertices, places]),
            faces=self.faces,
            source=np.concatenate([self.source, self.source[index]]),
        )

    def turned(self) -> Piece:
        """Turn all faces round."""
        return Piece(vertices=self.vertices, faces=self.faces[:, ::-1], source=self.source)

    def area_normals(self) -> NDArray[np.float64]:
        """(m, 3) face normals as long as the faces' areas."""
        a, b, c = self.vertices[self.faces].transpose(1, 0, 2)
        return np.asarray(np.cross(b - a, c - a) / 2.0)

    def normals(self) -> NDArray[np.float64]:
        """(n, 3) unit normals, each face weighted by its angle at the vertex; +z where they cancel."""
        count = len(self.vertices)
        corners = self.vertices[self.faces]
        along = np.roll(corners, -1, axis=1) - corners
        back = np.roll(corners, 1, axis=1) - corners
        angle = np.arctan2(np.linalg.norm(np.cross(along, back), axis=2), (along * back).sum(axis=2))
        face = self.area_normals()
        length = np.linalg.norm(face, axis=1, keepdims=True)
        unit = np.where(length > 0.0, face / np.where(length > 0.0, length, 1.0), 0.0)
        weighted = (angle[:, :, None] * unit[:, None, :]).reshape(-1, 3)
        total = np.stack(
            [np.bincount(self.faces.ravel(), weights=axis, minlength=count) for axis in weighted.T], axis=1
        )
        length = np.linalg.norm(total, axis=1, keepdims=True)
        return np.where(length > 0.0, total / np.where(length > 0.0, length, 1.0), [0.0, 0.0, 1.0])
