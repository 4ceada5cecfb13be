"""A space of displacements in which patches of a surface move as a whole, and which can be refined."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from pyamg.aggregation import fit_candidates

from o3d_relief.linalg.multigrid import aggregates, smoothed, sorted_matrix

__all__ = ["Patches"]


class Patches:
    """Patches of vertices, each of which moves by a linear function of the vertices' positions.

    A relief is a scene whose depth is scaled by a factor that changes from place to place: what z' - z has of
    the roughness of z a linear function of x, y and z has, too. The patches are the aggregates of multigrid,
    level by level, down to single vertices: they follow strong couplings, and end at weak ones.

    Parameters
    ----------
    form : (n, n) sparse float64
        Tells what is strongly coupled.
    positions : (n, 3) float64
    most : int
        Number of patches to begin with, at most, where couplings are strong enough for so few.
    """

    def __init__(self, form: sp.csr_array, positions: NDArray[np.float64], most: int) -> None:
        n = len(positions)
        self._candidates = np.column_stack([np.ones(n), positions - positions.mean(axis=0)])
        self._levels = [np.arange(n)]
        matrix, found = sorted_matrix(form), n
        while found > most:
            gathered = aggregates(matrix)
            number, count = _numbers(gathered)
            if count == found:
                break
            self._levels.append(number[self._levels[-1]])
            finer = smoothed(matrix, _columns(number, count))
            matrix, found = sorted_matrix(finer.T.tocsr() @ (matrix @ finer)), count
        self._level = np.full(n, len(self._levels) - 1)

    @property
    def number(self) -> NDArray[np.int64]:
        """The patch of each vertex, (n,)."""
        levels = np.stack(self._levels)
        own = levels[self._level, np.arange(len(self._level))]
        return np.asarray(np.unique(self._level * len(own) + own, return_inverse=True)[1].ravel())

    def maps(self) -> sp.csr_matrix:
        """Return orthonormal displacements that span the space, (n, q)."""
        number = self.number
        gathered = _columns(number, int(number.max()) + 1)
        maps = sp.csr_matrix(fit_candidates(gathered, self._candidates)[0])
        maps.eliminate_zeros()
        used = np.bincount(maps.indices, minlength=maps.shape[1]) > 0
        place = np.cumsum(used) - 1
        return sp.csr_matrix(
            (maps.data, place[maps.indices].astype(np.int32), maps.indptr),
            shape=(maps.shape[0], int(used.sum())),
        )

    def split(self, missing: NDArray[np.float64], least: float) -> None:
        """Split those patches in which something is missing into those of the next finer level.

        Parameters
        ----------
        missing : (n,) float64
            What is missing at each vertex, at least 0.
        least : float
            As many patches are split as it takes for no more than this to be missing in the others.
        """
        number = self.number
        worth = np.bincount(number, weights=missing)
        order = np.argsort(worth, kind="stable")
        chosen = np.zeros(len(worth), dtype=bool)
        chosen[order[np.cumsum(worth[order]) > least]] = True
        self._level = np.where(chosen[number], np.maximum(self._level - 1, 0), self._level)


def _numbers(gathered: sp.csr_matrix) -> tuple[NDArray[np.int64], int]:
    """Return the aggregate of each unknown; those without one have their own."""
    alone = np.diff(gathered.indptr) == 0
    number = np.full(len(alone), -1, dtype=np.int64)
    number[~alone] = gathered.indices
    number[alone] = gathered.shape[1] + np.arange(alone.sum())
    used, number = np.unique(number, return_inverse=True)
    return number.ravel(), len(used)


def _columns(number: NDArray[np.int64], count: int) -> sp.csr_matrix:
    """Return the matrix, (n, count), with a 1 in each row at its number."""
    starts = np.arange(len(number) + 1, dtype=np.int32)
    return sp.csr_matrix((np.ones(len(number)), number.astype(np.int32), starts), shape=(len(number), count))
