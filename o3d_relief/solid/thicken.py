"""Thickness for surfaces that have none."""

from __future__ import annotations

import numpy as np
import open3d as o3d
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from o3d_relief.rays import unit_box
from o3d_relief.solid.chain import boundary
from o3d_relief.solid.orient import neighbours
from o3d_relief.solid.pieces import Piece

__all__ = ["charts", "room_behind", "shells"]

_CREASE = 0.77
"""Cosine of 40 degrees: charts end at sharper edges."""
_CONE = 0.5
"""Cosine of 60 degrees: charts whose normals turn away further from their mean are split."""
_FOLD = 0.4
"""Cosine of 66 degrees between a vertex normal and its faces, half the angle of a fold."""
_SHARE = 0.55
"""Share of the room up to the next wall that a wall may take: two of them then meet in the middle."""


def shells(piece: Piece, thickness: float, *, leave_room: bool = True) -> list[Piece]:
    """Turn an open surface into closed ones of some thickness, which together are as thick as asked for.

    The surface itself stays in place and the thickness goes to its back. It is taken apart into charts
    that are nearly flat first, so that no shell folds over into itself; the union of all is meant.

    Parameters
    ----------
    piece : Piece
        Faces turn to the side from which the surface is seen.
    thickness : float
        In millimetres.
    leave_room : bool
        Less where a wall of the same piece lies closer behind.

    Returns
    -------
    list of Piece
        Each without boundary.
    """
    chart = charts(piece)
    depth = np.full(len(piece.vertices), thickness)
    if leave_room:
        depth = np.minimum(depth, _SHARE * room_behind(piece))
    shared, sharpness = _offsets(piece)
    result = []
    order = np.argsort(chart, kind="stable")
    for rows in np.split(order, np.flatnonzero(np.diff(chart[order])) + 1):
        part, used = piece.only(rows), np.unique(piece.faces[rows])
        # Neighbouring charts go back in the same direction, so that nothing gapes between them, but where
        # the surface folds so sharply that there is no such direction.
        offset, folded = shared[used], sharpness[used] < _FOLD
        if folded.any():
            offset = np.where(folded[:, None], _offsets(part)[0], offset)
        result.append(_shell(part, depth[used, None] * offset))
    return result


def charts(piece: Piece) -> NDArray[np.int64]:
    """Take a surface apart into nearly flat pieces.

    Parameters
    ----------
    piece : Piece

    Returns
    -------
    (m,) int64
        Chart of each face: connected, without sharp edges, its normals within one octant or a narrow cone.
    """
    normals = piece.area_normals()
    area = np.linalg.norm(normals, axis=1)
    unit = normals / np.where(area > 0.0, area, 1.0)[:, None]
    pairs, _ = neighbours(piece.faces)
    smooth = pairs[(unit[pairs[:, 0]] * unit[pairs[:, 1]]).sum(axis=1) >= _CREASE]
    label = _connected(smooth, len(unit))
    mean = np.stack([np.bincount(label, weights=along) for along in normals.T], axis=1)
    mean = mean / np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-300)
    narrow = np.ones(label.max() + 1)
    np.minimum.at(narrow, label, (unit * mean[label]).sum(axis=1))
    wide = narrow[label] < _CONE
    side = np.abs(unit).argmax(axis=1)
    side = 1 + 2 * side + (np.take_along_axis(unit, side[:, None], axis=1)[:, 0] > 0)
    side = np.where(wide, side, 0)
    return _connected(smooth[side[smooth[:, 0]] == side[smooth[:, 1]]], len(unit))


def room_behind(piece: Piece) -> NDArray[np.float64]:
    """Measure how far behind each vertex the next wall of the same piece is.

    Parameters
    ----------
    piece : Piece

    Returns
    -------
    (n,) float64
        In millimetres, infinite where there is none.
    """
    normals = piece.normals()
    scene, middle, size = unit_box(piece.vertices, piece.faces)
    start = (piece.vertices - middle) / size - 1e-4 * normals
    rays = np.concatenate([start, -normals], axis=1).astype(np.float32)
    hit = scene.cast_rays(o3d.core.Tensor(rays))["t_hit"].numpy().astype(np.float64)
    return np.asarray((hit + 1e-4) * size)


def _offsets(piece: Piece) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Find how far each vertex must move so that its faces move back by 1, as a mitre does.

    Returns
    -------
    offset : (n, 3) float64
        At most 1 / _FOLD long.
    sharpness : (n,) float64
        Least cosine between the vertex normal and the normals of its faces.
    """
    normals = piece.normals()
    face = piece.area_normals()
    length = np.linalg.norm(face, axis=1)
    whole = length > 0.0
    unit = face[whole] / length[whole, None]
    corners = piece.faces[whole]
    cosine = np.ones(len(piece.vertices))
    np.minimum.at(cosine, corners, (unit[:, None, :] * normals[corners]).sum(axis=2))
    return -normals / np.maximum(cosine, _FOLD)[:, None], cosine


def _shell(chart: Piece, offset: NDArray[np.float64]) -> Piece:
    """Close a chart with a copy of itself behind it and walls between."""
    count = len(chart.vertices)
    edges = boundary(chart.faces)
    behind = chart.vertices + offset
    (a, b), (c, d) = edges.T, (edges + count).T
    walls = np.concatenate([np.stack([b, a, c], axis=1), np.stack([b, c, d], axis=1)])
    return chart.with_copies(np.arange(count), behind).with_faces(chart.faces[:, ::-1] + count, walls)


def _connected(pairs: NDArray[np.int64], count: int) -> NDArray[np.int64]:
    graph = coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)
