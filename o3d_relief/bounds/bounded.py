"""The closest relief of a given depth: bounds on the heights instead of points and compression."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from o3d_relief.bounds.gaps import out_of_order
from o3d_relief.bounds.missed import BetweenLines
from o3d_relief.bounds.pairs import Pairs
from o3d_relief.bounds.rows import gap_rows
from o3d_relief.linalg.interior import minimise
from o3d_relief.progress import Tick, silent

__all__ = ["Bounded", "closest_relief"]

_KEPT_GAP = 0.1
"""Every gap stays at least this share of what linear scaling would make of it."""

_MARGIN = 0.1
"""Share of the depth that the linear scaling which the solver starts from leaves free below and above."""

_HOLD = 1e3
"""Stiffness of the springs that hold the attached vertices on S, against cotangent weights of about 1."""

_HELD = 1e-2
"""Attached vertices that end within this share of the depth of S are set onto it."""

_TOUCH = 2e-3
"""Surfaces that are closer than this, in relief units, touch."""

_FEW_PARTS = 20
"""Parts up to which a large scene is solved in patches. Among many, which bound each other, the rounds soon
need nearly all unknowns: a temple of 290 parts took twice as long so."""

_LOOSE = 1e-9
"""Weight that keeps the system definite where nothing else holds a vertex."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Bounded:
    """The closest relief of a given depth.

    Attributes
    ----------
    z : (n,) float64
        New heights.
    rounds : int
        Linear systems solved.
    watched : int
        Rows of constraints that took part.
    gap : float
        Bound on how far the energy is above its minimum, as a share of it.
    corrected_pairs : int
        Pairs between the tested lines that had to be kept apart, too.
    left : int
        Pairs that are closer than asked for.
    attached_missed : int
        Attached vertices that could not be brought to S.
    """

    z: NDArray[np.float64]
    rounds: int
    watched: int
    gap: float
    corrected_pairs: int
    left: int
    attached_missed: int


def closest_relief(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    form: sp.csr_array,
    depth: float,
    pairs: Pairs,
    seen: sp.csr_array,
    visible: NDArray[np.bool_],
    *,
    pull: NDArray[np.float64],
    min_gap: float,
    attach: NDArray[np.int64],
    tick: Tick = silent,
) -> Bounded:
    """Find the heights within a depth that change the differential coordinates least.

    minimise    (z' - z)' K (z' - z) / 2 - pull' (z' - z)
    subject to  0 <= z'           for every visible vertex and every seen point
                z' <= depth       for every vertex
                gap' > 0          for every pair of stacked surfaces.

    Linear scaling fulfils every constraint with room to spare: the search starts there. In the end the
    relief is moved and stretched a little so that it reaches from S to the depth exactly, which keeps all
    constraints.

    Parameters
    ----------
    vertices : (n, 3) float64
        Original positions.
    faces : (m, 3) int64
    form : (n, n) sparse float64
        K, a weighted Dirichlet energy and springs.
    depth : float
        In the unit of z, less than the depth of what is visible.
    pairs : Pairs
        What is stacked on vertical lines.
    seen : (q, n) sparse float64
        Rows that give the heights of seen points of the surface; their weights are positive and sum to 1.
    visible : (n,) bool
    pull : (n,) float64
        Right-hand side that belongs to springs in `form`, zeros for none.
    min_gap : float
        Smallest gap of pairs that were not closer before.
    attach : (a,) int64
        Vertices to hold on S.
    tick : callable, optional
        Called in every round with the share of the work that is done; it may raise to end the work.

    Returns
    -------
    Bounded
    """
    z, n = vertices[:, 2], len(vertices)
    pairs = pairs.select(pairs.gap > _TOUCH / 2.0)
    lowest = lowest_seen(z, seen, visible)
    ratio = depth / (float(z.max()) - lowest)
    inside = _MARGIN * depth + (1.0 - 2.0 * _MARGIN) * ratio * (z - lowest)

    held = np.zeros(n)
    held[attach] = _HOLD
    hessian = (form + sp.diags_array(held + _LOOSE)).tocsr()
    lower = np.where(visible & (held == 0.0), 0.0, -np.inf)
    # Linear scaling must keep a little of its room: that is as far as a smallest gap can be asked for here.
    kept = np.clip(np.minimum(pairs.gap, min_gap), _KEPT_GAP * ratio * pairs.gap, 0.7 * ratio * pairs.gap)
    gaps = gap_rows(pairs, n)
    place = _Place(gaps, seen, visible, attach, depth)
    between = BetweenLines(vertices, faces, gaps)
    added = [0]

    def missed(x: NDArray[np.float64]) -> tuple[sp.csr_array, NDArray[np.float64]]:
        wrong, gap = between.missed(place(x))
        # What touches has no order; it may turn about the point of contact a little.
        least = np.where(gap > _TOUCH, _KEPT_GAP * ratio * gap, -_TOUCH / 4.0)
        added[0] += len(gap)
        return wrong, np.minimum(least, wrong @ inside - _TOUCH / 1000.0)

    found = minimise(
        hessian,
        pull - held * z,
        origin=z,
        start=inside,
        lower=lower,
        upper=np.full(n, depth),
        rows=sp.vstack([gaps, seen]).tocsr(),
        bound=np.concatenate([kept, np.zeros(seen.shape[0])]),
        more_rows=missed,
        positions=vertices,
        in_patches=_parts(faces, n) <= _FEW_PARTS,
        tick=tick,
    )
    result = place(found.x)
    return Bounded(
        z=result,
        rounds=found.rounds,
        watched=found.watched,
        gap=found.gap,
        corrected_pairs=added[0],
        left=int(out_of_order(pairs, result, min_gap=(1.0 - 1e-6) * min_gap).sum()),
        attached_missed=int((result[attach] != 0.0).sum()),
    )


def _parts(faces: NDArray[np.int64], n: int) -> int:
    """Count the parts that no triangle connects."""
    edges = faces[:, :2].ravel(), faces[:, 1:].ravel()
    graph = sp.coo_array((np.ones(2 * len(faces)), edges), (n, n))
    return int(connected_components(graph, directed=False, return_labels=False))


class _Place:
    """Move and stretch a relief so that it reaches from S to the depth, or set what is attached onto S."""

    def __init__(
        self,
        gaps: sp.csr_array,
        seen: sp.csr_array,
        visible: NDArray[np.bool_],
        attach: NDArray[np.int64],
        depth: float,
    ) -> None:
        self._gaps, self._seen, self._visible = gaps, seen, visible
        self._attach, self._depth = attach, depth

    def __call__(self, z: NDArray[np.float64]) -> NDArray[np.float64]:
        if len(self._attach) == 0:
            base = lowest_seen(z, self._seen, self._visible)
            result = (z - base) * (self._depth / (float(z.max()) - base))
        else:
            result = _onto_plane(z * (self._depth / float(z.max())), self._attach, self._gaps, self._depth)
        # Rounding must not leave anything visible behind S or beyond the depth.
        return np.asarray(np.minimum(np.where(self._visible, np.maximum(result, 0.0), result), self._depth))


def lowest_seen(z: NDArray[np.float64], seen: sp.csr_array, visible: NDArray[np.bool_]) -> float:
    """Return the height of the lowest point that is seen.

    Parameters
    ----------
    z : (n,) float64
    seen : (q, n) sparse float64
    visible : (n,) bool

    Returns
    -------
    float
    """
    return min(float(z[visible].min(initial=np.inf)), float((seen @ z).min(initial=np.inf)))


def _onto_plane(
    z: NDArray[np.float64], attach: NDArray[np.int64], gaps: sp.csr_array, depth: float
) -> NDArray[np.float64]:
    """Set attached vertices that are near S onto it, but for those that would change places with others."""
    near = attach[np.abs(z[attach]) <= _HELD * depth]
    result = z.copy()
    result[near] = 0.0
    while True:
        wrong = np.flatnonzero((gaps @ result <= 0.0) & (gaps @ z > 0.0))
        back = np.intersect1d(gaps[wrong].indices, near[result[near] != z[near]])
        if len(back) == 0:
            return np.asarray(result)
        result[back] = z[back]
