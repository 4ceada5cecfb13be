"""Surfaces stacked on vertical lines.

Only z moves, so a line along z meets the same points of the surface before and after: a pair of points that
follow each other on a line is fixed once and for all, and the change of its gap is linear in the
displacement.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from o3d_relief.bounds.lines import FROM, SAME_PLACE, UP, Hits, Lines, upright

__all__ = ["Pairs", "as_points", "close_pairs", "foot_pairs", "next_to_each_other", "vertex_pairs"]


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
        # ndarray.take copies whole rows; with brackets it takes four times as long.
        number = np.flatnonzero(chosen) if chosen.dtype == bool else chosen
        return Pairs(
            upper=self.upper.take(number, axis=0),
            upper_weights=self.upper_weights.take(number, axis=0),
            lower=self.lower.take(number, axis=0),
            lower_weights=self.lower_weights.take(number, axis=0),
            gap=self.gap.take(number),
        )

    def renumbered(self, number: NDArray[np.int64]) -> Pairs:
        """Return the pairs of a part of a mesh with the numbers of the whole: those of its vertices, (n,)."""
        return replace(self, upper=number[self.upper], lower=number[self.lower])

    def difference(self, n: int) -> sp.csr_array:
        """Return the matrix R, (p, n), with which R z is the height of the upper less that of the lower."""
        row = np.repeat(np.arange(len(self)), 3)
        values = np.concatenate([self.upper_weights.ravel(), -self.lower_weights.ravel()])
        columns = np.concatenate([self.upper.ravel(), self.lower.ravel()])
        return sp.coo_array((values, (np.concatenate([row, row]), columns)), shape=(len(self), n)).tocsr()

    @staticmethod
    def sorted_by(
        above: NDArray[np.bool_],
        one: tuple[NDArray[np.int64], NDArray[np.float64]],
        other: tuple[NDArray[np.int64], NDArray[np.float64]],
        gap: NDArray[np.float64],
    ) -> Pairs:
        """Make pairs of points, corners and weights, of which the one is above (p,), or else the other."""
        (upper, upper_weights), (lower, lower_weights) = (
            [np.where(first[:, None], a, b) for a, b in zip(one, other, strict=True)]
            for first in (above, ~above)
        )
        return Pairs(
            upper=upper, upper_weights=upper_weights, lower=lower, lower_weights=lower_weights, gap=gap
        )

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


def vertex_pairs(lines: Lines, *, aside: tuple[float, float] = (0.0, 0.0)) -> Pairs:
    """Pair each vertex with the next surface above and below it.

    Parameters
    ----------
    lines : Lines
        Of a mesh.
    aside : two float
        How far beside the vertices, in relief units, the lines pass.

    Returns
    -------
    Pairs
        At most 2 n; those closer than 1e-3 relief units are left out.
    """
    if len(lines.faces) == 0:
        return Pairs.join([])
    found = []
    for up in (1.0, -1.0):
        step = np.array([*aside, 2 * SAME_PLACE * up])
        if any(aside):
            found.append(_paired(lines, lines.first(lines.vertices + step, up * UP), up))
            continue
        hits = lines.above if up > 0.0 else lines.below
        near = hits.distance < 2 * SAME_PLACE - FROM
        found.append(_paired(lines, hits.select(np.flatnonzero(~near)), up))
        if near.any():
            again = hits.ray[near]
            further = lines.first(lines.vertices[again] + step, up * UP)
            found.append(_paired(lines, further.of(again), up))
    return Pairs.join(found)


def close_pairs(lines: Lines) -> Pairs:
    """Pair each vertex with the surfaces that are too close to it for `vertex_pairs`, but do not touch it.

    Parameters
    ----------
    lines : Lines
        Of a mesh.

    Returns
    -------
    Pairs
        With gaps between 5e-4 and about 1e-3 relief units.
    """
    if len(lines.faces) == 0:
        return Pairs.join([])
    found = []
    for up, hits in ((1.0, lines.above), (-1.0, lines.below)):
        close = _paired(lines, hits.select(np.flatnonzero(hits.distance <= 2.2 * SAME_PLACE)), up)
        found.append(close.select((close.gap > SAME_PLACE) & (close.gap < 2.2 * SAME_PLACE)))
    return Pairs.join(found)


def _paired(lines: Lines, hits: Hits, up: float) -> Pairs:
    """Pair the vertices, from which the rays come, with what they have met, upwards or downwards."""
    hit, other = hits.ray, lines.faces.take(hits.triangle, axis=0)
    # A ray may meet a steep triangle of its own vertex.
    elsewhere = (other[:, 0] != hit) & (other[:, 1] != hit) & (other[:, 2] != hit)
    usable = np.flatnonzero(elsewhere & ~lines.borders.grazed(hits.triangle, hits.weights))
    other, other_weights = other.take(usable, axis=0), hits.weights.take(usable, axis=0)
    own, own_weights = as_points(hit[usable])
    if up > 0.0:
        return next_to_each_other(lines.vertices[:, 2], other, other_weights, own, own_weights)
    return next_to_each_other(lines.vertices[:, 2], own, own_weights, other, other_weights)


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
    edges = edges.compress(z[edges[:, 0]] * z[edges[:, 1]] < 0.0, axis=0)
    moved = np.column_stack([vertices[:, :2], z])
    lines = Lines(moved, faces[~upright(vertices, faces)] if len(edges) else faces[:0])
    if len(lines.faces) == 0:
        return Pairs.join([])
    share = z[edges[:, 0]] / (z[edges[:, 0]] - z[edges[:, 1]])
    foot = vertices[edges[:, 0]] + share[:, None] * (vertices[edges[:, 1]] - vertices[edges[:, 0]])
    foot[:, 2] = 2 * SAME_PLACE
    hits = lines.first(foot, UP)
    hit, triangle, weights = hits.ray, hits.triangle, hits.weights
    own = (lines.faces[triangle][:, :, None] == edges[hit][:, None, :]).any(axis=1).all(axis=1)
    usable = ~own & ~lines.borders.grazed(triangle, weights)
    hit, other, other_weights = hit[usable], lines.faces[triangle[usable]], weights[usable]
    corners = edges[hit][:, [0, 1, 1]]
    at_foot = np.stack([1.0 - share[hit], share[hit], np.zeros(len(hit))], axis=1)
    return next_to_each_other(vertices[:, 2], corners, at_foot, other, other_weights)


def as_points(vertices: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Write vertices as points of triangles: (q, 3) corners and weights."""
    weights = np.zeros((len(vertices), 3))
    weights[:, 0] = 1.0
    return np.repeat(vertices[:, None], 3, axis=1), weights


def next_to_each_other(
    z: NDArray[np.float64],
    upper: NDArray[np.int64],
    upper_weights: NDArray[np.float64],
    lower: NDArray[np.int64],
    lower_weights: NDArray[np.float64],
) -> Pairs:
    """Pair points that follow each other on lines, but not neighbours on the surface, which meet there.

    Parameters
    ----------
    z : (n,) float64
    upper, lower : (q, 3) int64
        Corners of their triangles.
    upper_weights, lower_weights : (q, 3) float64

    Returns
    -------
    Pairs
    """
    top = np.einsum("pc,pc->p", z[upper], upper_weights)
    gap = top - np.einsum("pc,pc->p", z[lower], lower_weights)
    everything = Pairs(
        upper=upper, upper_weights=upper_weights, lower=lower, lower_weights=lower_weights, gap=gap
    )
    close = gap <= SAME_PLACE
    neighbours = np.zeros(len(gap), dtype=bool)
    neighbours[close] = (upper[close][:, :, None] == lower[close][:, None, :]).any(axis=(1, 2))
    return everything.select((gap > -SAME_PLACE) & ~neighbours)
