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

from o3d_relief.bounds.pairs import Pairs, touching_pairs

__all__ = ["Ties", "tie_parts"]

_ACROSS_GAPS = 0.1
"""Stiffness of a spring across a gap, against cotangent weights of about 1."""

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
    """Tie the connected components of a mesh to each other.

    Parameters
    ----------
    vertices : (n, 3) float64
        In the relief frame, in relief units.
    faces : (m, 3) int64
    laplacian : (n, n) sparse float64
        The cotangent Laplacian, whose graph tells the components.
    index : (q,) int64
        The fixed points; a component without one is loose.
    pairs : Pairs
        What is stacked on vertical lines, of one component or of two.
    shrink : (p,) float64
        The gap that each pair would have if empty space were attenuated like a differential.
    across_gaps : float
        Stiffness of a spring across a gap, against cotangent weights of about 1.

    Returns
    -------
    Ties or None
        None for a mesh of one component.
    """
    count, label = connected_components(laplacian, directed=False)
    if count == 1:
        return None
    n = len(vertices)
    across = label[pairs.upper[:, 0]] != label[pairs.lower[:, 0]]
    apart = pairs.select(across)
    touching = touching_pairs(vertices, faces, label, _TOUCH)
    everything = laplacian + apart.difference(n).T @ apart.difference(n)
    everything = everything + touching.difference(n).T @ touching.difference(n)
    strays = _nearest_outside(vertices, *connected_components(everything, directed=False))

    held = np.isin(label, label[index])
    rows = sp.vstack([apart.difference(n), touching.difference(n), _edge_rows(strays, n)]).tocsr()
    stiffness = np.repeat([across_gaps, _IN_CONTACT, _IN_CONTACT], [len(apart), len(touching), len(strays)])
    change = np.concatenate([shrink[across] - apart.gap, np.zeros(len(touching) + len(strays))])
    loose = np.concatenate(
        [
            ~(held[apart.upper[:, 0]] & held[apart.lower[:, 0]]),
            ~(held[touching.upper[:, 0]] & held[touching.lower[:, 0]]),
            ~held[strays].all(axis=1),
        ]
    )
    form, pull = [], []
    for chosen in (~loose, loose):
        weighted = rows[chosen].T @ sp.diags_array(stiffness[chosen])
        form.append((weighted @ rows[chosen]).tocsr())
        pull.append(np.asarray(weighted @ change[chosen]))
    return Ties(
        among_held=form[0],
        among_held_pull=pull[0],
        to_loose=form[1],
        to_loose_pull=pull[1],
        across_gaps=len(apart),
        in_contact=len(touching),
        to_nearest=len(strays),
    )


def _nearest_outside(
    vertices: NDArray[np.float64], groups: int, group: NDArray[np.int32]
) -> NDArray[np.int64]:
    """Pair each group but the largest with the vertex of the largest that is nearest to it, (q, 2)."""
    if groups == 1:
        return np.zeros((0, 2), dtype=np.int64)
    largest = np.bincount(group).argmax()
    home, away = np.flatnonzero(group == largest), np.flatnonzero(group != largest)
    distance, nearest = cKDTree(vertices[home]).query(vertices[away])
    order = np.lexsort((distance, group[away]))
    _, first = np.unique(group[away][order], return_index=True)
    chosen = order[first]
    return np.stack([away[chosen], home[nearest[chosen]]], axis=1)


def _edge_rows(edges: NDArray[np.int64], n: int) -> sp.csr_array:
    rows = np.repeat(np.arange(len(edges)), 2)
    values = np.tile([1.0, -1.0], len(edges))
    return sp.coo_array((values, (rows, edges.ravel())), shape=(len(edges), n)).tocsr()
