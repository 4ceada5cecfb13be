"""Scenes of many parts: what ties loose parts to the rest.

The differential coordinates of the paper live on one connected surface. Between parts that are not connected,
springs take their place: along vertical lines they shrink the empty space between two parts by the same
attenuation as the differentials of the surface, and where two parts touch they keep them together.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from o3d_relief.bounds.pairs import Pairs
from o3d_relief.bounds.touching import touching_pairs

__all__ = ["PartSprings", "Ties", "find_springs", "tie_parts"]

_ACROSS_GAPS = 0.1
"""Stiffness of a spring across a gap, against cotangent weights of about 1."""

_FOLLOWING = 0.1
"""Share of that where one of the two parts holds no fixed point: over its empty space it is to move, not to
be drawn out into spikes by springs that disagree."""

_IN_CONTACT = 10.0
"""Stiffness of a spring between points that touch."""

_TOUCH = 0.1
"""Parts that are closer than this, in relief units, touch."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Ties:
    """Springs between parts, as additions to the systems of the construction.

    Attributes
    ----------
    among_held : (n, n) sparse float64
        Quadratic form of the springs between parts that hold a fixed point.
    among_held_pull : (n,) float64
        The right-hand side that belongs to it.
    to_loose : (n, n) sparse float64
        The same for all springs of which at least one end lies on a loose part: loose parts follow, and do
        not pull.
    to_loose_pull : (n,) float64
    across_gaps, in_contact, to_nearest : int
        Number of springs of each kind.
    """

    among_held: sp.csr_array
    among_held_pull: NDArray[np.float64]
    to_loose: sp.csr_array
    to_loose_pull: NDArray[np.float64]
    across_gaps: int
    in_contact: int
    to_nearest: int


@dataclass(frozen=True, kw_only=True, eq=False)
class PartSprings:
    """All springs between the parts of a mesh, whichever of them hold a fixed point.

    Attributes
    ----------
    rows : (s, n) sparse float64
        The difference of heights that each spring answers to.
    stiffness : (s,) float64
    ends : (s, 2) int64
        A vertex of each of the two parts.
    stacked : Pairs
        What the springs across gaps, which come first, hold apart.
    in_contact, to_nearest : int
        Number of springs of the other two kinds.
    """

    rows: sp.csr_array
    stiffness: NDArray[np.float64]
    ends: NDArray[np.int64]
    stacked: Pairs
    in_contact: int
    to_nearest: int

    def loose(self, held: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Find the springs (s,) with an end on a part without a fixed point; `held` (n,) are the others."""
        return np.asarray(~held[self.ends].all(axis=1))

    def change(self, shrink: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return by how much each spring is longer at rest, (s,), for the gaps (len(stacked),) at rest."""
        change = np.zeros(len(self.stiffness))
        change[: len(self.stacked)] = shrink - self.stacked.gap
        return change

    def system(
        self, chosen: NDArray[np.bool_], *, following: bool = False
    ) -> tuple[sp.csr_array, sp.csr_array]:
        """Return the quadratic form (n, n) of some springs, and what their changes pull with, (n, s').

        Those that loose parts follow are softer across gaps.
        """
        stiffness = self.stiffness.copy()
        if following:
            stiffness[: len(self.stacked)] *= _FOLLOWING
        weighted = self.rows[chosen].T @ sp.diags_array(stiffness[chosen])
        return (weighted @ self.rows[chosen]).tocsr(), weighted.tocsr()

    def ties(self, held: NDArray[np.bool_], shrink: NDArray[np.float64]) -> Ties:
        """Sort the springs by whether both their parts hold a fixed point.

        Parameters
        ----------
        held : (n,) bool
            The vertices of parts that hold a fixed point.
        shrink : (len(stacked),) float64
            The gap of each stacked pair if empty space were attenuated like a differential.

        Returns
        -------
        Ties
        """
        loose, change = self.loose(held), self.change(shrink)
        among_held, held_pull = self.system(~loose)
        to_loose, loose_pull = self.system(loose, following=True)
        return Ties(
            among_held=among_held,
            among_held_pull=held_pull @ change[~loose],
            to_loose=to_loose,
            to_loose_pull=loose_pull @ change[loose],
            across_gaps=len(self.stacked),
            in_contact=self.in_contact,
            to_nearest=self.to_nearest,
        )


def find_springs(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    laplacian: sp.csr_array,
    pairs: Pairs,
    *,
    across_gaps: float = _ACROSS_GAPS,
) -> PartSprings | None:
    """Find the springs that tie the connected components of a mesh to each other.

    Parameters
    ----------
    vertices : (n, 3) float64
        In the relief frame, in relief units.
    faces : (m, 3) int64
    laplacian : (n, n) sparse float64
        The cotangent Laplacian, whose graph tells the components.
    pairs : Pairs
        What is stacked on vertical lines, of one component or of two.
    across_gaps : float
        Stiffness of a spring across a gap, against cotangent weights of about 1.

    Returns
    -------
    PartSprings or None
        None for a mesh of one component.
    """
    count, label = connected_components(laplacian, directed=False)
    if count == 1:
        return None
    n = len(vertices)
    apart = pairs.select(label[pairs.upper[:, 0]] != label[pairs.lower[:, 0]])
    touching = touching_pairs(vertices, faces, label, _TOUCH)
    rows = [apart.difference(n), touching.difference(n)]
    everything = laplacian + rows[0].T @ rows[0]
    everything = everything + rows[1].T @ rows[1]
    strays = _nearest_outside(vertices, *connected_components(everything, directed=False))
    ends = [np.stack([some.upper[:, 0], some.lower[:, 0]], axis=1) for some in (apart, touching)]
    return PartSprings(
        rows=sp.vstack([*rows, _edge_rows(strays, n)]).tocsr(),
        stiffness=np.repeat(
            [across_gaps, _IN_CONTACT, _IN_CONTACT], [len(apart), len(touching), len(strays)]
        ),
        ends=np.concatenate([*ends, strays]),
        stacked=apart,
        in_contact=len(touching),
        to_nearest=len(strays),
    )


def tie_parts(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    laplacian: sp.csr_array,
    index: NDArray[np.int64],
    pairs: Pairs,
    shrink: NDArray[np.float64],
    *,
    across_gaps: float = _ACROSS_GAPS,
) -> Ties | None:
    """Tie the connected components of a mesh to each other, by the springs of `find_springs`.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int64
    laplacian : (n, n) sparse float64
    index : (q,) int64
        The fixed points; a component without one is loose.
    pairs : Pairs
    shrink : (p,) float64
        The gap that each pair would have if empty space were attenuated like a differential.
    across_gaps : float

    Returns
    -------
    Ties or None
        None for a mesh of one component.
    """
    springs = find_springs(vertices, faces, laplacian, pairs, across_gaps=across_gaps)
    if springs is None:
        return None
    _, label = connected_components(laplacian, directed=False)
    across = label[pairs.upper[:, 0]] != label[pairs.lower[:, 0]]
    return springs.ties(np.isin(label, label[index]), shrink[across])


def _nearest_outside(
    vertices: NDArray[np.float64], groups: int, group: NDArray[np.int32]
) -> NDArray[np.int64]:
    """Pair each group but the largest with the vertex of the largest that is nearest to it, (q, 2)."""
    if groups == 1:
        return np.zeros((0, 2), dtype=np.int64)
    largest = np.bincount(group).argmax()
    home, away = np.flatnonzero(group == largest), np.flatnonzero(group != largest)
    distance, nearest = cKDTree(vertices[home], balanced_tree=False, compact_nodes=False).query(
        vertices[away]
    )
    order = np.lexsort((distance, group[away]))
    _, first = np.unique(group[away][order], return_index=True)
    chosen = order[first]
    return np.stack([away[chosen], home[nearest[chosen]]], axis=1)


def _edge_rows(edges: NDArray[np.int64], n: int) -> sp.csr_array:
    rows = np.repeat(np.arange(len(edges)), 2)
    values = np.tile([1.0, -1.0], len(edges))
    return sp.coo_array((values, (rows, edges.ravel())), shape=(len(edges), n)).tocsr()
