"""Normals for drawing: smooth over curved surfaces, split at creases."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

__all__ = ["crease_normals", "number_places"]

_CROWD = 1000  # faces around a point: their pairs would not fit the memory


def crease_normals(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    normals: NDArray[np.float32],
    crease_degrees: float,
) -> NDArray[np.float32]:
    """Return corner normals that are smooth but split at creases.

    A corner takes the mean of the normals of the faces around its point that differ from its own face by
    at most `crease_degrees`. Vertices in one place count as one, so that seams do not show. A face
    weighs in with twice its area over the root of its edge lengths at the corner: between the sine of
    the angle, which trusts needles too much, and the area, which trusts large faces too much. Where more
    than a thousand faces meet, each keeps its own normal.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int64
        Each with an area.
    normals : (m, 3) float32
        Unit face normals.
    crease_degrees : float
        0 gives flat shading.

    Returns
    -------
    (m, 3, 3) float32
    """
    if crease_degrees <= 0.0:
        return np.repeat(normals[:, None, :], 3, axis=1)
    point = number_places(vertices)[faces].ravel()  # corner 3 f + c
    weighted = (_corner_weights(vertices, faces)[..., None] * normals[:, None, :]).reshape(-1, 3)
    count = int(point.max()) + 1
    total = np.column_stack([np.bincount(point, weighted[:, c], minlength=count) for c in range(3)])
    mean = total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-300)
    result: NDArray[np.float32] = mean[point].astype(np.float32)

    # Where all faces lie within half the crease of their mean, no two differ by more than the crease.
    own = np.repeat(normals, 3, axis=0)
    aligned = np.einsum("ij,ij->i", own, result)
    sharp = np.zeros(count, dtype=bool)
    sharp[point[aligned < np.cos(np.deg2rad(0.5 * crease_degrees))]] = True
    crowded = np.bincount(point, minlength=count)[point] > _CROWD
    result[crowded] = own[crowded]
    corners = np.flatnonzero(sharp[point] & ~crowded)
    corners = corners[np.argsort(point[corners], kind="stable")]
    limit = np.cos(np.deg2rad(crease_degrees))
    for block in _blocks(point[corners], 1_000_000):
        result[corners[block]] = _split_normals(
            point[corners[block]], own[corners[block]], weighted[corners[block]], limit
        )
    return np.asarray(result.reshape(-1, 3, 3))


def number_places(vertices: NDArray[np.float64]) -> NDArray[np.int64]:
    """Give each vertex the number of its place: equal positions, equal numbers."""
    bits = (vertices + 0.0).view(np.uint64)
    with np.errstate(over="ignore"):
        key = bits[:, 0] * np.uint64(0x9E3779B97F4A7C15)
        key = (key ^ (key >> np.uint64(29)) ^ bits[:, 1]) * np.uint64(0xBF58476D1CE4E5B9)
        key = (key ^ (key >> np.uint64(32)) ^ bits[:, 2]) * np.uint64(0x94D049BB133111EB)
    return np.asarray(np.unique(key ^ (key >> np.uint64(31)), return_inverse=True)[1], dtype=np.int64)


def _corner_weights(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.float32]:
    corners = vertices[faces]
    edges = np.roll(corners, -1, axis=1) - corners  # edge c leaves corner c
    length = np.maximum(np.linalg.norm(edges, axis=2), 1e-300)
    area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    weights = area[:, None] / np.sqrt(length * np.roll(length, 1, axis=1))
    return np.asarray(weights / weights.max(), dtype=np.float32)


def _blocks(groups: NDArray[np.int64], pairs: int) -> list[slice]:
    """Cut sorted groups into runs of whole groups with about so many pairs."""
    if len(groups) == 0:
        return []
    start = np.flatnonzero(np.r_[True, groups[1:] != groups[:-1]])
    size = np.diff(np.r_[start, len(groups)])
    number = (np.cumsum(size**2) - size**2) // pairs
    cut = np.r_[start[np.r_[True, number[1:] != number[:-1]]], len(groups)]
    return [slice(int(a), int(b)) for a, b in pairwise(cut)]


def _split_normals(
    groups: NDArray[np.int64], own: NDArray[np.float32], weighted: NDArray[np.float32], limit: float
) -> NDArray[np.float32]:
    """Return, for each corner, the mean over its group's corners whose normals agree with its own."""
    start = np.flatnonzero(np.r_[True, groups[1:] != groups[:-1]])
    size = np.diff(np.r_[start, len(groups)])
    partners = np.repeat(size, size)
    first = np.repeat(np.arange(len(groups)), partners)
    offset = np.arange(len(first)) - np.repeat(np.cumsum(partners) - partners, partners)
    second = np.repeat(np.repeat(start, size), partners) + offset
    agree = np.einsum("ij,ij->i", own[first], own[second]) >= limit
    first, second = first[agree], second[agree]
    total = np.column_stack(
        [np.bincount(first, weighted[second, c], minlength=len(groups)) for c in range(3)]
    )
    total = total + 1e-6 * own  # where all weights are nearly 0
    return np.asarray(total / np.linalg.norm(total, axis=1, keepdims=True), dtype=np.float32)
