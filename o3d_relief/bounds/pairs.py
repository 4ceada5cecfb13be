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

__all__ = ["Pairs", "close_pairs", "foot_pairs", "grid_pairs", "touching_pairs", "upright", "vertex_pairs"]

_SAME_PLACE = 5e-4
"""Points of a line that are closer than this, in relief units, are one: rays are cast in float32."""

_UPRIGHT = 0.01
"""Share of its area at which a triangle, seen from the front, counts as upright: there an error of float32 in
x and y is one of more than 1e-3 relief units in z."""

_NARROW = 0.01
"""Change of weights up to which points are moved onto their lines."""

_BLOCK = 16384
"""Triangles that are worked on at once."""

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
        Distance before; positive, or a rounding error off 0 where they touch.
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

    def select(self, chosen: NDArray[np.bool_] | NDArray[np.int64]) -> Pairs:
        """Return some of the pairs, by a mask or by number."""
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
        corners, weights = [np.zeros((0, 3), dtype=np.int64)], [np.zeros((0, 3))]
        return Pairs(
            upper=np.concatenate(corners + [part.upper for part in parts]),
            upper_weights=np.concatenate(weights + [part.upper_weights for part in parts]),
            lower=np.concatenate(corners + [part.lower for part in parts]),
            lower_weights=np.concatenate(weights + [part.lower_weights for part in parts]),
            gap=np.concatenate([np.zeros(0)] + [part.gap for part in parts]),
        )


def upright(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Find the triangles that stand on S within half a degree: where a line meets them is chance.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int64

    Returns
    -------
    (m,) bool
        Those without an area, too.
    """
    places, corners = np.ascontiguousarray(vertices.T), np.ascontiguousarray(faces.T)
    standing = np.zeros(len(faces), dtype=bool)
    for begin in range(0, len(faces), _BLOCK):
        a, b, c = corners[:, begin : begin + _BLOCK]
        (ux, uy, uz), (vx, vy, vz) = (places[:, end] - places[:, a] for end in (b, c))
        x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        standing[begin : begin + _BLOCK] = np.abs(z) <= _UPRIGHT * np.sqrt(x**2 + y**2 + z**2)
    return standing


class _Borders:
    """The borders of a mesh, seen from the front: a line that grazes one meets the surface by chance."""

    def __init__(self, vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> None:
        n = len(vertices)
        corners = np.ascontiguousarray(faces.T)
        start, end = corners[[1, 2, 0]], corners[[2, 0, 1]]
        edge = np.minimum(start, end) * n + np.maximum(start, end)
        ordered = np.sort(edge, axis=None)
        alone = np.ones(len(ordered), dtype=bool)
        same = ordered[1:] == ordered[:-1]
        alone[1:] &= ~same
        alone[:-1] &= ~same
        single = ordered[alone]
        place = np.minimum(np.searchsorted(single, edge), max(len(single) - 1, 0))
        self._on_border = single[place].T == edge.T if len(single) else np.zeros(faces.shape, dtype=bool)
        at_border = np.zeros(n, dtype=bool)
        at_border[single // n] = True
        at_border[single % n] = True
        self._corner_on_border = at_border[faces]
        x, y = np.ascontiguousarray(vertices[:, :2].T)
        across, along = x[end] - x[start], y[end] - y[start]
        area = np.abs(across[0] * along[1] - along[0] * across[1])
        opposite = np.sqrt(across**2 + along**2)
        self._height = (area / np.maximum(opposite, np.finfo(np.float64).tiny)).T

    def grazed(self, triangle: NDArray[np.int64], weights: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Tell which points of triangles, (q,) and (q, 3), lie on a border, to a rounding error."""
        near = weights * self._height[triangle] < 2 * _SAME_PLACE
        at_corner = near.sum(axis=1, keepdims=True) - near == 2
        grazed = (near & self._on_border[triangle]) | (at_corner & self._corner_on_border[triangle])
        return np.asarray(grazed.any(axis=1))


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
    faces = faces[~upright(vertices, faces)]
    if len(faces) == 0:
        return Pairs.join([])
    everything = np.arange(len(vertices))
    box, borders = _UnitBox(vertices, faces), _Borders(vertices, faces)
    return Pairs.join(
        [
            _next_pairs(vertices, faces, box, borders, everything, 2 * _SAME_PLACE * direction)
            for direction in (_UP, -_UP)
        ]
    )


def close_pairs(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> Pairs:
    """Pair each vertex with the surfaces that are too close to it for `vertex_pairs`, but do not touch it.

    Parameters
    ----------
    vertices : (n, 3) float64
        In the relief frame, in relief units.
    faces : (m, 3) int64

    Returns
    -------
    Pairs
        With gaps between 5e-4 and about 1e-3 relief units.
    """
    faces = faces[~upright(vertices, faces)]
    if len(faces) == 0:
        return Pairs.join([])
    box, borders = _UnitBox(vertices, faces), _Borders(vertices, faces)
    found = []
    for direction in (_UP, -_UP):
        step = 0.1 * _SAME_PLACE * direction
        rays = box.rays(vertices + step, direction)
        reach = 2.2 * _SAME_PLACE / box.size
        candidates = np.flatnonzero(box.scene.test_occlusions(rays, tfar=reach).numpy())
        if len(candidates):
            close = _next_pairs(vertices, faces, box, borders, candidates, step)
            found.append(close.select((close.gap > _SAME_PLACE) & (close.gap < 2.2 * _SAME_PLACE)))
    return Pairs.join(found)


def _next_pairs(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    box: _UnitBox,
    borders: _Borders,
    chosen: NDArray[np.int64],
    step: NDArray[np.float64],
) -> Pairs:
    """Pair chosen vertices with the next surface in the direction of a step, from there on."""
    direction = np.sign(step)
    hits = box.scene.cast_rays(box.rays(vertices[chosen] + step, direction))
    met = np.flatnonzero(hits["primitive_ids"].numpy() != _MISS)
    triangle = hits["primitive_ids"].numpy()[met].astype(np.int64)
    other_weights = _weights(hits["primitive_uvs"].numpy()[met])
    hit = chosen[met]
    # A ray may meet a steep triangle of its own vertex.
    usable = (faces[triangle] != hit[:, None]).all(axis=1) & ~borders.grazed(triangle, other_weights)
    hit, other, other_weights = hit[usable], faces[triangle[usable]], other_weights[usable]
    own, own_weights = _corners(hit)
    if direction[2] > 0:
        return _pairs(vertices[:, 2], other, other_weights, own, own_weights)
    return _pairs(vertices[:, 2], own, own_weights, other, other_weights)


def grid_pairs(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    *,
    side: int = 1024,
    low: NDArray[np.float64] | None = None,
    high: NDArray[np.float64] | None = None,
) -> Pairs:
    """Pair the points that follow each other on the lines of a regular grid.

    Parameters
    ----------
    vertices : (n, 3) float64
        In the relief frame, in relief units.
    faces : (m, 3) int64
    side : int
        Number of lines along x and along y.
    low, high : (3,) float64, optional
        Corners of the box that the grid covers, that of the vertices where omitted.

    Returns
    -------
    Pairs
        Neighbours on the surface, which meet where the line passes, are left out. The gap of surfaces that
        touch is known to a rounding error only, and may be a little less than 0.
    """
    faces = faces[~upright(vertices, faces)]
    if len(faces) == 0:
        return Pairs.join([])
    box = _UnitBox(vertices, faces)
    low = vertices.min(axis=0) if low is None else low
    high = vertices.max(axis=0) if high is None else high
    steps = (np.arange(side) + 0.5) / side
    x, y = np.meshgrid(low[0] + steps * (high[0] - low[0]), low[1] + steps * (high[1] - low[1]))
    start = np.stack(
        [x.ravel(), y.ravel(), np.full(side * side, vertices[:, 2].min() - 0.01 * box.size)], axis=1
    )
    hits = box.scene.list_intersections(box.rays(start, _UP))
    triangle = hits["primitive_ids"].numpy().astype(np.int64)
    weights = _weights(hits["primitive_uvs"].numpy())
    usable = np.flatnonzero(~_Borders(vertices, faces).grazed(triangle, weights))
    triangle, weights = triangle[usable], weights[usable]
    line = hits["ray_ids"].numpy()[usable].astype(np.int64)
    t = hits["t_hit"].numpy()[usable].astype(np.float64)
    # One sort by line and height on it: t is well below the factor's size, and float64 has room for both.
    order = np.argsort(line + t / (4.0 * max(float(t.max(initial=0.0)), 1.0)), kind="stable")
    following = np.flatnonzero(line[order][1:] == line[order][:-1])
    lower, upper = (
        _on_line(vertices, faces[triangle[chosen]], weights[chosen], start[line[chosen], :2])
        for chosen in (order[following], order[following + 1])
    )
    return _pairs(vertices[:, 2], *upper, *lower)


def _on_line(
    vertices: NDArray[np.float64],
    corners: NDArray[np.int64],
    weights: NDArray[np.float64],
    line: NDArray[np.float64],
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return points of triangles, (q, 3) corners and weights, put onto their lines (q, 2) exactly.

    Rays in float32 miss them by a little, which is much in z where a triangle is steep. Of those that are so
    narrow that the line passes beside them, the weights stay.
    """
    x, y = (np.ascontiguousarray(vertices[:, axis])[corners.T] - line[:, axis] for axis in (0, 1))
    exact = np.stack([x[i - 2] * y[i - 1] - x[i - 1] * y[i - 2] for i in range(3)], axis=1)
    area = exact.sum(axis=1, keepdims=True)
    exact /= np.where(area == 0.0, 1.0, area)
    beside = (area[:, 0] == 0.0) | (np.abs(exact - weights).max(axis=1) > _NARROW)
    return corners, np.where(beside[:, None], weights, exact)


def foot_pairs(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    edges: NDArray[np.int64],
    z: NDArray[np.float64],
) -> Pairs:
    """Pair the points where edges pass through S with the next surface above, once the vertices have moved.

    There the trim makes new vertices.

    Parameters
    ----------
    vertices : (n, 3) float64
        Before.
    faces : (m, 3) int64
    edges : (e, 2) int64
    z : (n,) float64
        Heights after.

    Returns
    -------
    Pairs
        Those that changed places; upper and lower as they were before.
    """
    lying = faces[~upright(np.column_stack([vertices[:, :2], z]), faces) & ~upright(vertices, faces)]
    edges = edges[z[edges].prod(axis=1) < 0.0]
    if len(edges) == 0 or len(lying) == 0:
        return Pairs.join([])
    share = z[edges[:, 0]] / (z[edges[:, 0]] - z[edges[:, 1]])
    foot = vertices[edges[:, 0]] + share[:, None] * (vertices[edges[:, 1]] - vertices[edges[:, 0]])
    foot[:, 2] = 2 * _SAME_PLACE
    moved = np.column_stack([vertices[:, :2], z])
    box, borders = _UnitBox(moved, lying), _Borders(moved, lying)
    hits = box.scene.cast_rays(box.rays(foot, _UP))
    hit = np.flatnonzero(hits["primitive_ids"].numpy() != _MISS)
    triangle = hits["primitive_ids"].numpy()[hit].astype(np.int64)
    weights = _weights(hits["primitive_uvs"].numpy()[hit])
    own = (lying[triangle][:, :, None] == edges[hit][:, None, :]).any(axis=1).all(axis=1)
    usable = ~own & ~borders.grazed(triangle, weights)
    hit, other, other_weights = hit[usable], lying[triangle[usable]], weights[usable]
    corners = edges[hit][:, [0, 1, 1]]
    at_foot = np.stack([1.0 - share[hit], share[hit], np.zeros(len(hit))], axis=1)
    return _pairs(vertices[:, 2], corners, at_foot, other, other_weights)


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
    close = gap <= _SAME_PLACE
    neighbours = np.zeros(len(gap), dtype=bool)
    neighbours[close] = (upper[close][:, :, None] == lower[close][:, None, :]).any(axis=(1, 2))
    return everything.select((gap > -_SAME_PLACE) & ~neighbours)
