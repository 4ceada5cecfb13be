"""Edges sorted by what they are in the picture."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["ON", "Footprints", "footprints", "projected"]

ON = 1e-3
"""A point lies on an edge, in the picture, within this many relief units."""

_ONE_PLACE = 1e-4
"""Rounding, in relief units, by which points count as one in the picture: what is missed costs time only."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Footprints:
    """Edges sorted by what they are in the picture.

    Attributes
    ----------
    first : (s,) int64
        One edge of each footprint.
    edge : (e,) int64
        All edges, by footprint.
    begin : (s + 1,) int64
        Where those of each footprint begin in `edge`.
    left, right : (s,) bool
        Whether there are faces on these sides of the first edge.
    """

    first: NDArray[np.int64]
    edge: NDArray[np.int64]
    begin: NDArray[np.int64]
    left: NDArray[np.bool_]
    right: NDArray[np.bool_]

    def members(self, chosen: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return all edges of chosen footprints, and the place of each one's footprint among the chosen."""
        count = self.begin[chosen + 1] - self.begin[chosen]
        of = np.repeat(np.arange(len(chosen)), count)
        within = np.arange(len(of)) - np.repeat(np.cumsum(count) - count, count)
        return self.edge[self.begin[chosen][of] + within], of

    def numbers(self) -> NDArray[np.int64]:
        """Return the number of the footprint of each edge, -1 for those that have none."""
        number = np.full(int(self.edge.max(initial=-1)) + 1, -1)
        number[self.edge] = np.repeat(np.arange(len(self.first)), np.diff(self.begin))
        return number

    def combined(self, one: NDArray[np.int64], other: NDArray[np.int64]) -> NDArray[np.int64]:
        """Combine all edges over the footprints of some with all over those of others, (2, q)."""
        number = self.numbers()
        edge, of = self.members(number[one])
        second, of_edge = self.members(number[other[of]])
        return np.stack([edge[of_edge], second])


def footprints(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    edges: NDArray[np.int64],
    chosen: NDArray[np.int64],
) -> Footprints:
    """Sort chosen edges, by rising number, by what they are in the picture; upright ones are left out."""
    plane = vertices[:, :2]
    chosen = chosen[np.abs(plane[edges[chosen, 1]] - plane[edges[chosen, 0]]).max(axis=1) > ON]
    left, right = _beside(plane, faces, edges, chosen)
    ends = _numbered(np.rint(plane[edges[chosen].ravel()] / _ONE_PLACE)).reshape(-1, 2)
    turned = ends[:, 0] > ends[:, 1]
    left, right = np.where(turned, right, left), np.where(turned, left, right)
    key = (ends.min(axis=1) * (ends.max(initial=0) + 1) + ends.max(axis=1)) * 4 + 2 * left + right
    order = np.argsort(key, kind="stable")
    begin = np.flatnonzero(np.diff(key[order], prepend=-1))
    first = order[begin]
    return Footprints(
        first=chosen[first],
        edge=chosen[order],
        begin=np.append(begin, len(order)),
        left=np.where(turned, right, left)[first],
        right=np.where(turned, left, right)[first],
    )


def _numbered(places: NDArray[np.float64]) -> NDArray[np.int64]:
    """Give each of the places (q, 2) a number, the same to the same."""
    order = np.lexsort(places.T)
    new = np.ones(len(order), dtype=bool)
    new[1:] = (places[order[1:]] != places[order[:-1]]).any(axis=1)
    number = np.zeros(len(order), dtype=np.int64)
    number[order] = np.cumsum(new) - 1
    return number


def projected(
    plane: NDArray[np.float64], edges: NDArray[np.int64], points: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return where points lie along edges in the picture.

    Parameters
    ----------
    plane : (n, 2) float64
    edges : (q, 2) int64
    points : (q,) int64
        A vertex for each edge.

    Returns
    -------
    share, off, length : (q,) float64
        How far along the edge, as a share of it; how far to its left; how long the edge is.
    """
    begin = plane.take(edges[:, 0], axis=0)
    along, from_begin = plane.take(edges[:, 1], axis=0) - begin, plane.take(points, axis=0) - begin
    length = np.sqrt(along[:, 0] ** 2 + along[:, 1] ** 2)
    share = (along[:, 0] * from_begin[:, 0] + along[:, 1] * from_begin[:, 1]) / length**2
    return share, (along[:, 0] * from_begin[:, 1] - along[:, 1] * from_begin[:, 0]) / length, length


def _beside(
    plane: NDArray[np.float64], faces: NDArray[np.int64], edges: NDArray[np.int64], chosen: NDArray[np.int64]
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Tell on which sides, in the picture, chosen edges have faces: to the left and to the right, (q,)."""
    n = len(plane)
    at = np.zeros(n, dtype=bool)
    at[edges[chosen]] = True
    around = faces[at[faces].sum(axis=1) > 1]
    start, end, opposite = around[:, [[1, 2, 0], [2, 0, 1], [0, 1, 2]]].transpose(1, 0, 2).reshape(3, -1)
    key, own = edges[chosen] @ [n, 1], np.minimum(start, end) * n + np.maximum(start, end)
    found = np.minimum(np.searchsorted(key, own), max(len(key) - 1, 0))
    known = key[found] == own if len(key) else np.zeros(0, dtype=bool)
    found, opposite = found[known], opposite[known]
    _, off, _ = projected(plane, edges[chosen[found]], opposite)
    left, right = np.zeros(len(chosen), dtype=bool), np.zeros(len(chosen), dtype=bool)
    left[found[off > ON]] = True
    right[found[off < -ON]] = True
    return left, right
