"""The least correction that brings surfaces back into order."""

from __future__ import annotations

from functools import partial

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from o3d_relief.bounds.pairs import Pairs
from o3d_relief.errors import SolverError
from o3d_relief.linalg.quadratic import minimise
from o3d_relief.threads import each

__all__ = ["Correction"]

_REACH = 4.0
"""Distance over which a correction fades out, in multiples of its size: slopes change by a quarter."""

_SHORTEST, _LONGEST = 1.5, 8.0
"""The same in relief units, at least and at most."""

_AROUND, _WIDER, _FURTHEST = 1.0, 2.0, 32.0
"""What lies further from what is new than this many reaches stays as it is; where that leaves no room it is
so many times as far, and in the end everything may move."""

_DIGITS = 8
"""Decimals to which inequalities are the same; one more would be a rounding error."""

_SMALL = 1000
"""Vertices of regions that are solved together: a programme has its own costs."""

_HELD = 1e-5
"""Relief units by which a gap that is held may miss: ten times what programmes are solved to."""

_EXACT = 1e-3
"""Share by which a correction may be above the least one: a thousandth more does not show."""

_REGION = 3.0
"""What lies further from every correction than this many reaches is not touched, unless it is in the way."""


class Correction:
    """The least correction of heights that keeps gaps, near what has to be corrected.

    minimise  e' C e + sum of A_i e_i^2 / reach_i^2   subject to inequalities on z + e.

    Parameters
    ----------
    vertices : (n, 3) float64
        Original positions, in relief units.
    laplacian : (n, n) sparse float64
        C.
    areas : (n,) float64
    z : (n,) float64
        Heights to correct.
    """

    def __init__(
        self,
        vertices: NDArray[np.float64],
        laplacian: sp.csr_array,
        areas: NDArray[np.float64],
        z: NDArray[np.float64],
    ) -> None:
        self._vertices = vertices
        self._laplacian = laplacian
        self._areas = areas
        self._z = z
        self._size = np.zeros(len(vertices))
        self._nearest = np.full(len(vertices), -1)
        self._distance = np.full(len(vertices), np.inf)
        self._correction = np.zeros(len(vertices))
        self._widening = 1.0
        self._wide = np.full(len(vertices), np.inf)
        self._first = True

    def solve(
        self,
        pairs: Pairs,
        wanted: NDArray[np.float64],
        floor: NDArray[np.bool_],
        new: NDArray[np.bool_],
    ) -> NDArray[np.float64]:
        """Find the heights that keep the gaps wanted, and what is in front of S there.

        Corrections fade out: those far from what is new stay as they are, unless they are in the way. So do
        those that hang together with it neither by the surface nor by pairs.

        Parameters
        ----------
        pairs : Pairs
        wanted : (p,) float64
            Their gaps.
        floor : (n,) bool
            Vertices that are to lie at 0 or above.
        new : (n,) bool
            Vertices of pairs that were not among those of the last call, and of the floor.

        Returns
        -------
        (n,) float64

        Raises
        ------
        SolverError
            No heights do so, or the solver did not find them.
        """
        upper, lower = pairs.heights(self._z)
        missing = wanted - (upper - lower)
        lift = np.where(floor, -self._z, 0.0)
        single = sp.eye_array(len(self._z), format="csr")
        rows = sp.vstack([pairs.difference(len(self._z)), single[floor]], format="csr")
        rows, least = _once(rows, np.concatenate([missing, lift[floor]]))
        columns = rows.tocsc()
        reach = self._reaches(pairs, missing, lift)
        waiting = new.copy()
        while True:
            failed = np.zeros(len(waiting), dtype=bool)
            regions = self._regions(reach, columns, waiting)
            minimum = partial(self._minimum, reach=reach, rows=rows, columns=columns, least=least)
            for free, correction in zip(regions, each(minimum, regions), strict=True):
                if correction is None:
                    failed[free] = True
                else:
                    self._correction[free] = correction
            if not failed.any():
                break
            waiting &= failed
            if np.isfinite(self._wide[waiting]).all():
                # What is held around leaves no room; it rarely leaves more the next time.
                self._wide[failed] *= _WIDER
                self._wide[self._wide > _FURTHEST] = np.inf
                continue
            if (reach > 0.0).all():
                raise SolverError(
                    f"The order of {len(pairs)} pairs of surfaces could not be restored; the mesh is likely "
                    "broken near very thin triangles: repair it, or give in_order=False."
                )
            self._widening *= 2.0  # what lies around the region leaves no room
            self._distance[:] = np.inf
            reach = self._reaches(pairs, missing, lift)
        # The first time everything may move; later on what once needed room gets it again, but not all of it.
        self._wide = np.where(np.isfinite(self._wide), self._wide, _AROUND if self._first else _FURTHEST)
        self._first = False
        return np.asarray(self._z + self._correction)

    def _minimum(
        self,
        free: NDArray[np.int64],
        reach: NDArray[np.float64],
        rows: sp.csr_array,
        columns: sp.csc_array,
        least: NDArray[np.float64],
    ) -> NDArray[np.float64] | None:
        """Solve for the corrections of some vertices, the others held; None where there are none."""
        others = self._correction.copy()
        others[free] = 0.0
        within = columns[:, free].tocsr()
        own = np.flatnonzero(np.diff(within.indptr))
        form, concerned, least = self._laplacian[free], rows[own], least[own]
        now = concerned @ self._correction
        # What was held to a rounding error may leave no room for more, if what lies around stays as it is.
        least = np.where(now > least - _HELD, np.minimum(least, now), least)
        return minimise(
            form[:, free] + sp.diags_array(self._areas[free] / reach[free] ** 2),
            -(form @ others),
            within[own],
            least - concerned @ others,
            tolerance=_EXACT,
        )

    def _regions(
        self, reach: NDArray[np.float64], columns: sp.csc_array, new: NDArray[np.bool_]
    ) -> list[NDArray[np.int64]]:
        """Find the vertices whose corrections hang together with what is new, and not too far from it.

        Each region, of numbers of vertices, can be solved without the others; small ones are put together.
        """
        numbers = np.flatnonzero(reach > 0.0)
        wide = self._wide[new]
        if np.isfinite(wide).all():
            near = np.zeros(len(numbers), dtype=bool)
            for width in np.unique(wide):
                near |= self._within(numbers, np.flatnonzero(new)[wide == width], width * reach)
            numbers = numbers[near]
        surface = self._laplacian[numbers][:, numbers]
        count, label = connected_components(surface + _coupled(columns[:, numbers]), directed=False)
        wanted = np.zeros(count, dtype=bool)
        wanted[label[new[numbers]]] = True
        order = np.argsort(label, kind="stable")
        size = np.where(wanted, np.bincount(label, minlength=count), 0)
        last = np.flatnonzero(np.diff(np.cumsum(size) // _SMALL))
        chosen = numbers[order[wanted[label[order]]]]
        return [part for part in np.split(chosen, np.cumsum(size)[last]) if len(part)]

    def _within(
        self, numbers: NDArray[np.int64], start: NDArray[np.int64], most: NDArray[np.float64]
    ) -> NDArray[np.bool_]:
        """Tell which vertices are no further from the nearest of some than `most` (n,) says there."""
        distance, nearest = cKDTree(self._vertices[start], balanced_tree=False, compact_nodes=False).query(
            self._vertices[numbers], distance_upper_bound=most[start].max()
        )
        found: NDArray[np.bool_] = np.isfinite(distance)
        near = np.flatnonzero(found)
        found[near] = distance[near] <= most[start][nearest[near]]
        return found

    def _reaches(
        self,
        pairs: Pairs,
        missing: NDArray[np.float64],
        lift: NDArray[np.float64],
    ) -> NDArray[np.float64]:
        """Return how far a correction reaches at each vertex, 0 where none may move it."""
        for corners in (pairs.upper, pairs.lower):
            np.maximum.at(self._size, corners.ravel(), np.repeat(missing, 3))
        self._size = np.maximum(self._size, lift)
        touched = self._size > 0.0
        reach_there = np.where(touched, np.clip(_REACH * self._size, _SHORTEST, _LONGEST), 0.0)
        fresh = np.flatnonzero(touched & (self._distance > 0.0))
        if len(fresh):
            distance, nearest = cKDTree(
                self._vertices[fresh], balanced_tree=False, compact_nodes=False
            ).query(self._vertices, distance_upper_bound=self._widening * _REGION * _LONGEST)
            nearer = distance < self._distance
            self._distance[nearer], self._nearest[nearer] = distance[nearer], fresh[nearest[nearer]]
        reach = np.where(self._nearest < 0, 0.0, reach_there[self._nearest])
        reach[self._distance > self._widening * _REGION * reach] = 0.0
        return reach


def _once(rows: sp.csr_array, least: NDArray[np.float64]) -> tuple[sp.csr_array, NDArray[np.float64]]:
    """Leave out inequalities that ask for no more than another one of the same row.

    Where edges meet in the picture all triangles at the one tell the same of all at the other.
    """
    # Equal rows have equal products with any two vectors; others do by a chance of one in millions.
    mark = np.round(rows @ np.random.default_rng(0).random((rows.shape[1], 2)), _DIGITS)
    order = np.lexsort((-least, mark[:, 1], mark[:, 0]))
    other = np.ones(len(order), dtype=bool)
    other[1:] = (mark[order[1:]] != mark[order[:-1]]).any(axis=1)
    chosen = np.sort(order[other])
    return rows[chosen], least[chosen]


def _coupled(columns: sp.csc_array) -> sp.csr_array:
    """Return a graph (n, n) in which the unknowns of each of some inequalities (m, n) hang together."""
    rows = columns.tocsr()
    row = np.repeat(np.arange(rows.shape[0]), np.diff(rows.indptr))
    same = np.flatnonzero(row[1:] == row[:-1])
    ends = rows.indices[same], rows.indices[same + 1]
    return sp.csr_array((np.ones(len(same)), ends), shape=(rows.shape[1], rows.shape[1]))
