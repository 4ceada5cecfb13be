"""Surfaces stacked on vertical lines.

Only z moves, so a line along z meets the same points of the surface before and after: a pair of points that
follow each other on a line is fixed once and for all, and the change of its gap is linear in the
displacement.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import open3d as o3d
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from o3d_relief.rays import unit_box

__all__ = ["Pairs", "grid_pairs", "touching_pairs", "vertex_pairs"]

_SAME_PLACE = 1e-3
"""Points of a line that are closer than this, in relief units, are one: rays are cast in float32."""

_MISS = 0xFFFFFFFF


@dataclass(frozen=True, kw_only=True, eq=False)
class Pairs:
    """Pairs of surface points, one above the other.

    Attributes
    ----------
    upper, lower : (p, 3) int64
        The three vertices of the triangle of each point.
    upper_weights, lower_weights : (p, 3) float64
        Barycentric coordinates of the points.
    gap : (p,) float64
        Distance before, positive.
    """

    upper: NDArray[np.int64]
    upper_weights: NDArray[np.float64]
    lower: NDArray[np.int64]
    lower_weights: NDArray[np.float64]
    gap: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.gap)

    def heights(self, z: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the heights of the upper and of the lower points, (p,) each, for vertex heights z (n,)."""
        return (
            np.einsum("pc,pc->p", z[self.upper], self.upper_weights),
            np.einsum("pc,pc->p", z[self.lower], self.lower_weights),
        )

    def select(self, chosen: NDArray[np.bool_]) -> Pairs:
        """Return some of the pairs."""
        return Pairs(
            upper=self.upper[chosen],
            upper_weights=self.upper_weights[chosen],
            lower=self.lower[chosen],
            lower_weights=self.lower_weights[chosen],
            gap=self.gap[chosen],
        )

    def difference(self, n: int) -> sp.csr_array:
        """Return the matrix R, (p, n), with which R z is the height of the upper less that of the lower."""
        row = np.repeat(np.arange(len(self)), 3)
        values = np.concatenate([self.upper_weights.ravel(), -self.lower_weights.ravel()])
        columns = np.concatenate([self.upper.ravel(), self.lower.ravel()])
        return sp.coo_array((values, (np.concatenate([row, row]), columns)), shape=(len(self), n)).tocsr()

    @staticmethod
    def join(parts: list[Pairs]) -> Pairs:
        """Put several sets of pairs together."""
        return Pairs(
            upper=np.concatenate([part.upper for part in parts]),
            upper_weights=np.concatenate([part.upper_weights for part in parts]),
            lower=np.concatenate([part.lower for part in parts]),
            lower_weights=np.concatenate([part.lower_weights for part in parts]),
            gap=np.concatenate([part.gap for part in parts]),
        )


class _UnitBox:
    """A mesh in the unit box, and rays of one direction through it."""

    def __init__(self, vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> None:
        self.scene, self.middle, self.size = unit_box(vertices, faces)

    def rays(self, origins: NDArray[np.float64], direction: NDArray[np.float64]) -> o3d.core.Tensor:
        rays = np.zeros((len(origins), 6), dtype=np.float32)
        rays[:, :3] = (origins - self.middle) / self.size
        rays[:, 3:] = direction
        return o3d.core.Tensor(rays)


_UP = np.array([0.0, 0.0, 1.0])


def _weights(uv: NDArray[np.float32]) -> NDArray[np.float64]:
    u, v = uv.astype(np.float64).T
    return np.stack([1.0 - u - v, u, v], axis=1)


def vertex_pairs(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> Pairs:
    """Pair each vertex with the next surface above and below it.

    Parameters
    ----------
    vertices : (n, 3) float64
        In the relief frame, in relief units.
    faces : (m, 3) int64

    Returns
    -------
    Pairs
        At most 2 n; those closer than 1e-3 relief units are left out.
    """
    box = _UnitBox(vertices, faces)
    found = []
    for direction in (_UP, -_UP):
        hits = box.scene.cast_rays(box.rays(vertices + 10 * _SAME_PLACE * direction, direction))
        triangle = hits["primitive_ids"].numpy()
        hit = np.flatnonzero(triangle != _MISS)
        other = faces[triangle[hit].astype(np.int64)]
        other_weights = _weights(hits["primitive_uvs"].numpy()[hit])
        own, own_weights = _corners(hit)
        if direction[2] > 0:
            found.append(_pairs(vertices[:, 2], other, other_weights, own, own_weights))
        else:
            found.append(_pairs(vertices[:, 2], own, own_weights, other, other_weights))
    return Pairs.join(found)


def grid_pairs(vertices: NDArray[np.float64], faces: NDArray[np.int64], *, side: int = 1024) -> Pairs:
    """Pair the points that follow each other on the lines of a regular grid.

    Parameters
    ----------
    vertices : (n, 3) float64
        In the relief frame, in relief units.
    faces : (m, 3) int64
    side : int
        Number of lines along x and along y.

    Returns
    -------
    Pairs
        Those closer than 1e-3 relief units are left out.
    """
    box = _UnitBox(vertices, faces)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    steps = (np.arange(side) + 0.5) / side
    x, y = np.meshgrid(low[0] + steps * (high[0] - low[0]), low[1] + steps * (high[1] - low[1]))
    start = np.stack([x.ravel(), y.ravel(), np.full(side * side, low[2] - 0.01 * box.size)], axis=1)
    hits = box.scene.list_intersections(box.rays(start, _UP))
    line = hits["ray_ids"].numpy().astype(np.int64)
    t = hits["t_hit"].numpy().astype(np.float64)
    # One sort by line and height on it: t is well below the factor's size, and float64 has room for both.
    order = np.argsort(line + t / (4.0 * max(float(t.max(initial=0.0)), 1.0)), kind="stable")
    line, t = line[order], t[order]
    following = np.flatnonzero((line[1:] == line[:-1]) & ((t[1:] - t[:-1]) * box.size > _SAME_PLACE))
    lower, upper = order[following], order[following + 1]
    triangle = hits["primitive_ids"].numpy()
    uv = hits["primitive_uvs"].numpy()
    return _pairs(
        vertices[:, 2],
        faces[triangle[upper].astype(np.int64)],
        _weights(uv[upper]),
        faces[triangle[lower].astype(np.int64)],
        _weights(uv[lower]),
    )


def touching_pairs(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], label: NDArray[np.int32], reach: float
) -> Pairs:
    """Pair each vertex with the surfaces of other parts that lie within reach along x, y or z.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int64
    label : (n,) int
        The part of each vertex.
    reach : float
        In relief units.

    Returns
    -------
    Pairs
        The vertices above, whichever way the other surface lies; the gap counts along the axis.
    """
    box = _UnitBox(vertices, faces)
    candidates = _near_other_parts(vertices, label, reach)
    found = []
    for axis in np.eye(3):
        hits = box.scene.list_intersections(box.rays(vertices[candidates] - reach * axis, axis))
        off = hits["t_hit"].numpy().astype(np.float64) * box.size - reach
        vertex = candidates[hits["ray_ids"].numpy().astype(np.int64)]
        other = faces[hits["primitive_ids"].numpy().astype(np.int64)]
        near = (np.abs(off) <= reach) & (label[vertex] != label[other[:, 0]])
        own, own_weights = _corners(vertex[near])
        found.append(
            Pairs(
                upper=own,
                upper_weights=own_weights,
                lower=other[near],
                lower_weights=_weights(hits["primitive_uvs"].numpy()[near]),
                gap=np.abs(off[near]),
            )
        )
    return Pairs.join(found)


def _near_other_parts(
    vertices: NDArray[np.float64], label: NDArray[np.int32], reach: float
) -> NDArray[np.int64]:
    """Return the vertices that may touch another part: not those of the largest part far from all others."""
    largest = np.bincount(label).argmax()
    others = np.flatnonzero(label != largest)
    own = np.flatnonzero(label == largest)
    if len(others) == 0:
        return others
    low = np.full((label.max() + 1, 3), np.inf)
    high = np.full((label.max() + 1, 3), -np.inf)
    np.minimum.at(low, label[others], vertices[others])
    np.maximum.at(high, label[others], vertices[others])
    part = np.unique(label[others])
    centre, half = (low[part] + high[part]) / 2, (high[part] - low[part]) / 2
    around = cKDTree(vertices[own]).query_ball_point(centre, np.linalg.norm(half, axis=1) + 2.0 * reach)
    near = np.zeros(len(own), dtype=bool)
    for members in around:
        near[members] = True
    return np.sort(np.concatenate([others, own[near]]))


def _corners(vertices: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Write vertices as points of triangles: (q, 3) corners and weights."""
    weights = np.zeros((len(vertices), 3))
    weights[:, 0] = 1.0
    return np.repeat(vertices[:, None], 3, axis=1), weights


def _pairs(
    z: NDArray[np.float64],
    upper: NDArray[np.int64],
    upper_weights: NDArray[np.float64],
    lower: NDArray[np.int64],
    lower_weights: NDArray[np.float64],
) -> Pairs:
    top = np.einsum("pc,pc->p", z[upper], upper_weights)
    gap = top - np.einsum("pc,pc->p", z[lower], lower_weights)
    everything = Pairs(
        upper=upper, upper_weights=upper_weights, lower=lower, lower_weights=lower_weights, gap=gap
    )
    return everything.select(gap > _SAME_PLACE)
