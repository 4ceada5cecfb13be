"""Surfaces that change places between the lines on which their order is kept."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from o3d_relief.bounds.crossings import Crossings, crossings, edges_of
from o3d_relief.bounds.grid import grid_pairs
from o3d_relief.bounds.lines import Lines, upright
from o3d_relief.bounds.origin import Origin
from o3d_relief.bounds.pairs import Pairs, foot_pairs, vertex_pairs
from o3d_relief.bounds.raster import Raster
from o3d_relief.bounds.rows import gap_rows
from o3d_relief.stages.trim import trim_behind

__all__ = ["BetweenLines"]

_SAME = 1e-3
"""Relief units below which float32 rays do not tell two surfaces apart."""

_SHALLOW = 1e-4
"""Depth in relief units from which crossings of surfaces that were apart count."""

_ASIDE = ((0.0, 0.0), (1e-5, 0.0), (-1e-5, 0.0), (0.0, 1e-5), (0.0, -1e-5))
"""How far beside vertices is looked, too, in relief units: of a vertex on the outline of a surface it is
chance in float32 on which side it comes to lie, and for the certificate that may be another one."""

_CLOSE = 0.05
"""Gap in relief units below which surfaces are close: most of what is missed is near such places."""

_FEW = 0.5
"""Share of the faces up to which a look at those near such places comes first."""


class BetweenLines:
    """Tells what changes places between the lines on which the order is kept.

    Parameters
    ----------
    vertices : (n, 3) float64
        Original positions.
    faces : (m, 3) int64
    gaps : (q, n) sparse float64, optional
        Rows that give the gaps of the pairs on these lines. Where they are small is looked first.
    """

    def __init__(
        self,
        vertices: NDArray[np.float64],
        faces: NDArray[np.int64],
        gaps: sp.csr_array | None = None,
    ) -> None:
        self._vertices, self._faces = vertices, faces
        self._edges = edges_of(faces)
        self._gaps, self._raster = gaps, Raster(vertices, faces)

    def missed(self, z: NDArray[np.float64]) -> tuple[sp.csr_array, NDArray[np.float64]]:
        """Find what crosses or has changed places where it did not before.

        Parameters
        ----------
        z : (n,) float64
            New heights.

        Returns
        -------
        rows : (p, n) sparse float64
            Rows R, with which R z is the gap of two places that have come out of order, or are next to some
            that have.
        gap : (p,) float64
            That of before. What lies behind S does not count.
        """
        found = self._close_by(z)
        if len(found) == 0:
            found = self._before_the_cut(z)
        if len(found):
            return gap_rows(found, len(z)), found.gap
        return self._after_the_cut(z)

    def _close_by(self, z: NDArray[np.float64]) -> Pairs:
        """Look where surfaces are close only: as long as much is missed, most of it is there."""
        close = np.zeros(len(z), dtype=bool)
        if self._gaps is not None:
            close[self._gaps[np.flatnonzero(self._gaps @ z < _CLOSE)].indices] = True
        faces = self._faces.compress(self._over_or_under(close), axis=0)
        if not 0 < len(faces) <= _FEW * len(self._faces):
            return Pairs.join([])
        close[:] = False
        close[faces] = True
        number, place = np.flatnonzero(close), np.cumsum(close) - 1
        part = BetweenLines(self._vertices[number], place[faces])
        return part._before_the_cut(z[number]).renumbered(number)

    def _over_or_under(self, chosen: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Find the faces that may lie above or below some with a chosen vertex, (m,)."""
        a, b, c = self._faces.T
        return self._raster.over_or_under(chosen[a] | chosen[b] | chosen[c])

    def _before_the_cut(self, z: NDArray[np.float64]) -> Pairs:
        before = self._vertices[:, 2]
        relief = np.column_stack([self._vertices[:, :2], z])
        met = crossings(relief, self._faces, self._edges)
        new = met.pierced(z) & ~met.pierced(before)
        # What is deepest between the edges of two triangles is less deep at them: of surfaces that were
        # apart, shallow crossings count, too.
        apart = np.abs(met.gaps(before)).min(axis=1) > 2.0 * _SAME
        new |= apart & met.pierced(z, deep=_SHALLOW) & ~met.pierced(before, deep=_SHALLOW / 2.0)
        new &= _in_front(met, before, z)
        crossing = met.select(new).pairs(before, z)
        # However many cross: what has turned far is hard to mend once the relief is close to the others.
        turned = _turned(vertex_pairs(Lines(relief, self._faces)), before)
        through = self._edges.compress(z[self._edges[:, 0]] * z[self._edges[:, 1]] < 0.0, axis=0)
        at_foot = np.zeros(len(z), dtype=bool)
        at_foot[through] = True
        # What lies over the feet, and what is next to that: the borders of what is left out are elsewhere.
        for _ in range(2):
            faces = self._faces.compress(self._over_or_under(at_foot), axis=0)
            at_foot[faces] = True
        found = Pairs.join([turned, foot_pairs(self._vertices, faces, through, z)])
        return Pairs.join([crossing, found.select(np.maximum(*found.heights(z)) > 0.0)])

    def _after_the_cut(self, z: NDArray[np.float64]) -> tuple[sp.csr_array, NDArray[np.float64]]:
        """Test the relief with its cut, as the certificate does.

        The edges that the cut makes cross surfaces between the edges of their triangles, and what stood
        upright in the scene, which is left out here, hides other surfaces.
        """
        n = len(z)
        places = np.column_stack([self._vertices[:, :2], z])
        cut = trim_behind(places, self._faces, np.ones(n, dtype=bool))
        if len(cut.faces) == 0:
            return sp.csr_array((0, n)), np.zeros(0)
        first, second = cut.vertex_from.T
        number = np.arange(len(first))
        weights = np.concatenate([1.0 - cut.vertex_share, cut.vertex_share])
        entries = np.concatenate([number, number]), np.concatenate([first, second])
        carry = sp.coo_array((weights, entries), shape=(len(first), n)).tocsr()
        before, after = carry @ self._vertices[:, 2], cut.vertices[:, 2]
        met = crossings(cut.vertices, cut.faces, edges_of(cut.faces))
        met = met.select(met.pierced(after) & ~met.pierced(before))
        origin = Origin(cut.faces, cut.parents, self._vertices)
        known = origin.crossed(met.edge[:, [0, 1, 1]], met.face)
        lying = cut.faces[~upright(np.column_stack([cut.vertices[:, :2], before]), cut.faces)]
        low, high = self._vertices.min(axis=0), self._vertices.max(axis=0)
        lines = Lines(cut.vertices, lying)
        at_vertices = [vertex_pairs(lines, aside=aside) for aside in _ASIDE]
        on_grid = grid_pairs(lines, low=low, high=high, before=before)
        turned = _turned(Pairs.join([*at_vertices, on_grid]), before)
        turned = turned.select(~origin.crossed(turned.upper, turned.lower))
        found = Pairs.join([met.select(~known).pairs(before, after), turned])
        return (gap_rows(found, len(first)) @ carry).tocsr(), found.gap


def _turned(stacked: Pairs, before: NDArray[np.float64]) -> Pairs:
    """Return the pairs of a relief that stood the other way round before, in the order of before."""
    gap = np.subtract(*stacked.heights(before))
    inverted = stacked.select(gap < -_SAME)
    return Pairs(
        upper=inverted.lower,
        upper_weights=inverted.lower_weights,
        lower=inverted.upper,
        lower_weights=inverted.upper_weights,
        gap=-gap[gap < -_SAME],
    )


def _in_front(met: Crossings, before: NDArray[np.float64], z: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Tell which crossings lie in front of S, or have something in front of it out of order, (c,)."""
    first, last = met.gaps(z).T
    change = first - last
    share = np.clip(first / np.where(change == 0.0, 1.0, change), 0.0, 1.0)
    start, end = z[met.edge].T[:, :, None]
    at_ends = start + met.along * (end - start)
    crossing = at_ends[:, 0] + share * (at_ends[:, 1] - at_ends[:, 0])
    pairs = met.pairs(before, z)
    upper, lower = pairs.heights(z)
    wrong = (upper < lower) & (np.maximum(upper, lower) > 0.0)
    return np.asarray((crossing > 0.0) | wrong.reshape(-1, 2).any(axis=1))
