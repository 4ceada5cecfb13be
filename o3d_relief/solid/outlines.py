"""Outlines of a surface seen from the front, so settled that nothing stands on the plate twice."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from o3d_relief.rays import unit_box
from o3d_relief.solid.chain import loops

if TYPE_CHECKING:
    import manifold3d

__all__ = ["once_covered"]

_ROUNDS = 40
_LEAST_MM2 = 1e-6
"""Smaller areas are rounding errors."""


def once_covered(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """Leave faces out so that each place of the plate is covered once or not at all.

    Seen along z, a face that turns to the viewer counts 1 and one that turns to the back -1. Where the sum is
    neither 0 nor 1, outlines cross; there faces go that enter what is solid already, or leave air. It ends
    where there is no such place, none of its faces is to go, or after 40 rounds.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int64

    Returns
    -------
    (q,) int64
        Rows of `faces` that stay.

    Examples
    --------
    >>> steps = np.array([[0, 0], [4, 0], [0, 4.0]])
    >>> points = np.concatenate([np.column_stack([steps + z, [z] * 3]) for z in (2.0, 3.0)])
    >>> once_covered(points, np.arange(6).reshape(2, 3)).tolist()
    [1]
    """
    stays = np.ones(len(faces), dtype=bool)
    if len(faces) == 0:
        return np.flatnonzero(stays)
    scene, middle, size = unit_box(vertices, faces)
    corners = vertices[faces][:, :, :2]
    (x, y), (u, v) = (corners[:, 1] - corners[:, 0]).T, (corners[:, 2] - corners[:, 0]).T
    upward = x * v > y * u
    ends, edge, turn = _edges(faces)
    net = np.bincount(edge.ravel(), weights=turn.ravel()).astype(np.int64)
    for _ in range(_ROUNDS):
        points = _wrong_places(vertices[:, :2], _directed(ends, net))
        if len(points) == 0:
            break
        start = np.column_stack([(points - middle[:2]) / size, np.ones(len(points))])
        rays = np.concatenate([start, np.tile([0.0, 0.0, -1.0], (len(points), 1))], axis=1)
        hits = scene.list_intersections(o3d.core.Tensor(rays.astype(np.float32)))
        line, face = hits["ray_ids"].numpy().astype(np.int64), hits["primitive_ids"].numpy().astype(np.int64)
        order = np.lexsort((face, hits["t_hit"].numpy(), line))
        order = order[stays[face[order]]]
        gone = _superfluous(line[order], face[order], upward)
        if len(gone) == 0:
            break
        stays[gone] = False
        np.subtract.at(net, edge[gone], turn[gone])
    return np.flatnonzero(stays)


def _superfluous(
    line: NDArray[np.int64], face: NDArray[np.int64], upward: NDArray[np.bool_]
) -> NDArray[np.int64]:
    """Walk along lines from the front and name the faces that enter what is solid or leave air."""
    gone: set[int] = set()
    last, solid = -1, False
    for number, row in zip(line.tolist(), face.tolist(), strict=True):
        if number != last:
            last, solid = number, False
        if bool(upward[row]) == solid:
            gone.add(row)
        solid = bool(upward[row])
    return np.array(sorted(gone), dtype=np.int64)


def _wrong_places(places: NDArray[np.float64], edges: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return a point (p, 2) in each area that outlines run round more than once, or the wrong way."""
    import manifold3d

    outlines = [places[loop] for loop in loops(edges)]
    if not outlines:
        return np.zeros((0, 2))
    (left, low), (right, high) = places.min(axis=0) - 1.0, places.max(axis=0) + 1.0
    # With a frame that runs clockwise everything counts one less.
    frame = np.array([[left, low], [left, high], [right, high], [right, low]])
    twice = manifold3d.CrossSection([*outlines, frame], manifold3d.FillRule.Positive)
    never = manifold3d.CrossSection(outlines, manifold3d.FillRule.Negative)
    return np.array([*_inside(twice), *_inside(never)]).reshape(-1, 2)


def _inside(areas: manifold3d.CrossSection) -> list[NDArray[np.float64]]:
    import manifold3d

    points = []
    for area in areas.decompose():
        if area.area() < _LEAST_MM2:
            continue
        polygons = area.to_polygons()
        triangles = np.concatenate(polygons)[np.asarray(manifold3d.triangulate(polygons))]
        (x, y), (u, v) = (triangles[:, 1] - triangles[:, 0]).T, (triangles[:, 2] - triangles[:, 0]).T
        points.append(triangles[np.abs(x * v - y * u).argmax()].mean(axis=0))
    return points


def _edges(faces: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Return the ends (e, 2) of the edges, and edge and direction of each side of each face, (m, 3)."""
    following = np.roll(faces, -1, axis=1)
    low, high = np.minimum(faces, following), np.maximum(faces, following)
    count = int(faces.max()) + 1
    keys, edge = np.unique(low * count + high, return_inverse=True)
    return (
        np.stack([keys // count, keys % count], axis=1),
        edge.reshape(-1, 3),
        np.where(faces < following, 1, -1),
    )


def _directed(ends: NDArray[np.int64], net: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the edges that do not cancel, as often as they are there."""
    rows = np.flatnonzero(net)
    edges = np.where((net[rows] > 0)[:, None], ends[rows], ends[rows][:, ::-1])
    return np.asarray(np.repeat(edges, np.abs(net[rows]), axis=0))
