"""Faces that turn the same way round as their neighbours."""

from __future__ import annotations

import numpy as np
import open3d as o3d
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from o3d_relief.rays import unit_box
from o3d_relief.solid.pieces import Piece

__all__ = ["neighbours", "oriented"]

_RAYS = 64
"""Rays from each face that is asked for the outside of its patch."""
_FACES = 2048
"""Faces of a patch that are asked at first."""
_ERRORS = 8.0
"""Standard errors from zero at which the answer is certain."""


def neighbours(faces: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Find the pairs of faces that share an edge which no third face has.

    Parameters
    ----------
    faces : (m, 3) int64

    Returns
    -------
    pairs : (e, 2) int64
    agree : (e,) bool
        The two turn the same way round.

    Examples
    --------
    >>> pairs, agree = neighbours(np.array([[0, 1, 2], [2, 1, 3], [3, 1, 4], [0, 2, 5]]))
    >>> pairs.tolist(), agree.tolist()
    ([[0, 3], [0, 1], [1, 2]], [True, True, True])
    """
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    key = np.minimum(start, end) * (faces.max() + 1) + np.maximum(start, end)
    order = np.argsort(key, kind="stable")
    _, first, count = np.unique(key[order], return_index=True, return_counts=True)
    first = first[count == 2]
    corners = np.stack([order[first], order[first + 1]], axis=1)
    return corners // 3, np.asarray(start[corners[:, 0]] == end[corners[:, 1]])


def oriented(piece: Piece) -> tuple[Piece, int]:
    """Turn faces round until neighbours agree, where they do not.

    A patch is what hangs together over edges of two faces. One in which all agree stays as it is. Any other
    is turned so that its outside is the side from which more rays get away; a patch with only one side
    (a Möbius strip) stays as it is.

    Parameters
    ----------
    piece : Piece

    Returns
    -------
    piece : Piece
    turned : int
        Number of faces turned round.
    """
    faces, count = piece.faces, len(piece.faces)
    pairs, agree = neighbours(faces)
    if agree.all():
        return piece, 0
    # Each face is there twice, as it is and turned (+ count): what agrees is tied together.
    first, second = pairs[:, 0], pairs[:, 1]
    other = np.where(agree, 0, count)
    rows = np.concatenate([first, first + count])
    columns = np.concatenate([second + other, second + count - other])
    graph = coo_matrix((np.ones(len(rows)), (rows, columns)), shape=(2 * count, 2 * count))
    label = connected_components(graph, directed=False)[1]
    plain, turned = label[:count], label[count:]
    patch = np.minimum(plain, turned)
    mixed = np.zeros(label.max() + 1, dtype=bool)
    mixed[patch[first[~agree]]] = True
    turn = mixed[patch] & (plain > turned)
    # Now each mixed patch agrees with itself; which of its two ways is right?
    score = _escape(piece, turn, patch, mixed)
    turn = np.where(mixed[patch] & (score[patch] < 0.0), ~turn, turn) & (plain != turned)
    return (
        Piece(
            vertices=piece.vertices, faces=np.where(turn[:, None], faces[:, ::-1], faces), source=piece.source
        ),
        int(turn.sum()),
    )


def _escape(
    piece: Piece, turn: NDArray[np.bool_], patch: NDArray[np.int64], mixed: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Find from which side of each mixed patch (p,) more rays get away: positive in front.

    A patch of many faces is judged by some of them, drawn at random, as soon as their mean is far from
    zero compared with its standard error; one that stays in doubt by all.
    """
    scene, middle, size = unit_box(piece.vertices, piece.faces)
    normals = piece.area_normals() * np.where(turn, -1.0, 1.0)[:, None]
    area = np.linalg.norm(normals, axis=1)
    rows = np.random.default_rng(0).permutation(np.flatnonzero(mixed[patch] & (area > 0.0)))
    order = np.argsort(patch[rows], kind="stable")
    rows = rows[order]
    _, start, count = np.unique(patch[rows], return_index=True, return_counts=True)
    rank = np.arange(len(rows)) - np.repeat(start, count)
    result, squares = np.zeros(len(mixed)), np.zeros(len(mixed))
    taken, wanted, open_patch = 0, _FACES, mixed
    while (now := open_patch[patch[rows]] & (rank >= taken)).any():
        chosen = np.sort(rows[now & (rank < wanted)])
        unit = normals[chosen] / area[chosen, None]
        points = (piece.vertices[piece.faces[chosen]].mean(axis=1) - middle) / size
        found = _freer_side(scene, points, unit) * area[chosen]
        result += np.bincount(patch[chosen], weights=found, minlength=len(mixed))
        squares += np.bincount(patch[chosen], weights=found**2, minlength=len(mixed))
        # Of `wanted` faces, the sum is off by about the root of the sum of their squares.
        open_patch = open_patch & (np.abs(result) <= _ERRORS * np.sqrt(squares))
        taken, wanted = wanted, 4 * wanted
    return result


def _freer_side(
    scene: o3d.t.geometry.RaycastingScene, points: NDArray[np.float64], unit: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Count the rays that get away in front of each point (q, 3) less those behind it."""
    result = np.zeros(len(points))
    # Directions over the whole sphere (a golden spiral), turned to the side of each face.
    step = np.arange(_RAYS) + 0.5
    polar, around = np.arccos(1.0 - 2.0 * step / _RAYS), np.pi * (1.0 + 5.0**0.5) * step
    for direction in np.stack(
        [np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)], axis=1
    ):
        side = np.sign(unit @ direction)
        rays = np.concatenate(
            [points + 1e-4 * side[:, None] * unit, np.broadcast_to(direction, unit.shape)], axis=1
        )
        hit = scene.test_occlusions(o3d.core.Tensor(rays.astype(np.float32))).numpy()
        result += np.where(hit, 0.0, side)
    return result
