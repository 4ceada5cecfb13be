"""The cut at the relief plane: what lies behind S goes (section 3.2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Trimmed", "trim_behind"]


_UNUSABLE = -2
"""Stands for the side of a vertex that is to be dropped."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Trimmed:
    """A mesh cut at z = 0 and where each of its pieces comes from.

    Attributes
    ----------
    vertices : (n_out, 3) float64
    faces : (m_out, 3) int64
    source_index : (n_out,) int64
        Input vertex of each output vertex, -1 for one made by the cut.
    vertex_from : (n_out, 2) int64
        The two input vertices between which each output vertex lies; twice the same for a kept one.
    vertex_share : (n_out,) float64
        Share of the second of them.
    face_from : (m_out,) int64
        Input face of each output face.
    parents : (m_out, 3) int64
        The input vertices of that face.
    faces_cut, faces_dropped : int
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    source_index: NDArray[np.int64]
    vertex_from: NDArray[np.int64]
    vertex_share: NDArray[np.float64]
    face_from: NDArray[np.int64]
    parents: NDArray[np.int64]
    faces_cut: int
    faces_dropped: int

    def to_vertices(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Carry values of the input vertices, (n_in, c), over to the output vertices."""
        first, second = values[self.vertex_from[:, 0]], values[self.vertex_from[:, 1]]
        return np.asarray(first + self.vertex_share[:, None] * (second - first))

    def to_corners(self, faces: NDArray[np.int64], values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Carry values of the input faces' corners, (m_in, 3, c), over to (m_out, 3, c)."""
        source = faces[self.face_from]
        own = values[self.face_from]
        ends = []
        for end in (0, 1):
            wanted = self.vertex_from[self.faces, end]
            corner = (source[:, None, :] == wanted[:, :, None]).argmax(axis=2)
            ends.append(np.take_along_axis(own, corner[:, :, None], axis=1))
        share = self.vertex_share[self.faces][:, :, None]
        return np.asarray(ends[0] + share * (ends[1] - ends[0]))


def trim_behind(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], usable: NDArray[np.bool_]
) -> Trimmed:
    """Cut a mesh at z = 0 and keep what lies in front.

    Triangles that straddle the plane are cut exactly at it, so that the foot of the relief is a clean
    planar curve; neighbours share the cut vertices. Kept vertices stay in input order, those made by the
    cut follow; vertices that no kept face uses are dropped.

    Parameters
    ----------
    vertices : (n_in, 3) float64
    faces : (m_in, 3) int64
    usable : (n_in,) bool
        False for vertices that are to be dropped together with their faces.

    Returns
    -------
    Trimmed
        With no faces if nothing lies in front of the plane.

    Examples
    --------
    >>> v = np.array([[0, 0, -1], [2, 0, 1], [0, 2, 1.0]])
    >>> trim_behind(v, np.array([[0, 1, 2]]), np.ones(3, dtype=bool)).vertices[2:].tolist()
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    """
    side = np.sign(vertices[:, 2]).astype(np.int8)
    corners = np.ascontiguousarray(faces.T)
    one, two, three = (np.where(usable, side, _UNUSABLE)[corner] for corner in corners)
    lowest = np.minimum(np.minimum(one, two), three)
    highest = np.maximum(np.maximum(one, two), three)
    uncut = np.flatnonzero(lowest >= 0)
    straddling = np.flatnonzero((lowest == -1) & (highest > 0))

    cut = faces[straddling]
    pieces, piece_from, edges = _cut_faces(cut, side[cut].astype(np.int64), vertices[:, 2])
    face_from = np.concatenate([uncut, straddling[piece_from]])
    order = np.argsort(face_from, kind="stable")
    all_faces, face_from = np.concatenate([faces[uncut], pieces])[order], face_from[order]

    used = np.zeros(len(vertices) + len(edges), dtype=bool)
    used[all_faces] = True

    z = vertices[:, 2]
    share = z[edges[:, 0]] / (z[edges[:, 0]] - z[edges[:, 1]])
    made = vertices[edges[:, 0]] + share[:, None] * (vertices[edges[:, 1]] - vertices[edges[:, 0]])
    made[:, 2] = 0.0
    itself = np.arange(len(vertices))
    number = np.cumsum(used) - 1
    return Trimmed(
        vertices=np.concatenate([vertices, made])[used],
        faces=number[all_faces],
        source_index=np.concatenate([itself, np.full(len(edges), -1)])[used],
        vertex_from=np.concatenate([np.stack([itself, itself], axis=1), edges])[used],
        vertex_share=np.concatenate([np.zeros(len(vertices)), share])[used],
        face_from=face_from,
        parents=faces[face_from],
        faces_cut=len(straddling),
        faces_dropped=len(faces) - len(uncut) - len(straddling),
    )


def _cut_faces(
    faces: NDArray[np.int64], side: NDArray[np.int64], height: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Cut straddling faces into the pieces in front.

    Returns
    -------
    pieces : (q, 3) int64
        Faces over input vertices and, from n_in on, cut vertices.
    piece_from : (q,) int64
        Row of `faces` that each piece is a part of.
    edges : (c, 2) int64
        Input vertices of each cut edge, the one in front first: the cut of an edge is the same seen from
        both its faces, and on both sides of a seam.
    """
    first_number = len(height)
    # Walk around each face: a corner that is not behind stays, an edge that crosses gives a cut vertex.
    following = np.roll(faces, -1, axis=1)
    crosses = side * np.roll(side, -1, axis=1) < 0
    front_first = np.where(
        (side > 0)[:, :, None], np.stack([faces, following], 2), np.stack([following, faces], 2)
    )
    edges, cut_number = np.unique(front_first[crosses], axis=0, return_inverse=True)
    walk = np.full((len(faces), 6), -1, dtype=np.int64)
    walk[:, 0::2] = np.where(side >= 0, faces, -1)
    walk[:, 1::2][crosses] = first_number + cut_number.ravel()
    # Move the gaps to the end, in walking order: a triangle or a quadrilateral remains.
    compact = np.take_along_axis(walk, np.argsort(walk < 0, axis=1, kind="stable"), axis=1)
    count = (walk >= 0).sum(axis=1)
    triangle = np.flatnonzero(count >= 3)
    quad = np.flatnonzero(count == 4)
    # A quadrilateral is cut from its higher kept corner: the same way on both sides of a two-sided sheet.
    corners = compact[quad, :4]
    z = np.append(height, np.full(len(edges), -np.inf))[corners]
    highest = z == z.max(axis=1, keepdims=True)
    start = np.where(highest, corners, first_number + len(edges)).argmin(axis=1)
    compact[quad, :4] = np.take_along_axis(corners, (start[:, None] + np.arange(4)) % 4, axis=1)
    pieces = np.concatenate([compact[triangle][:, [0, 1, 2]], compact[quad][:, [0, 2, 3]]])
    return pieces, np.concatenate([triangle, quad]), edges.reshape(-1, 2)
