"""A Cholesky factor in dense blocks, for the matrices of meshes that are dissected."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.linalg import lapack

from o3d_relief.errors import SolverError
from o3d_relief.linalg.dissection import Dissection

__all__ = ["Cholesky"]


class Cholesky:
    """The factor of a sparse symmetric positive definite matrix, by the multifrontal method.

    The blocks of a dissection are eliminated one after the other (Duff, Reid 1983). A block s and its border
    b, the later unknowns that it is tied to, directly or through what went before it, make up a dense front

        [ F_ss  F_sb ]        F_ss = C C',   W = C^-1 F_sb,
        [ F_bs  F_bb ]        F_bb - W' W  is what the fronts to come still see of it.

    Nearly all the work is products of dense matrices, several times as fast as a factor that is sparse
    entry by entry; so are substitutions with many right-hand sides.

    Parameters
    ----------
    matrix : (n, n) sparse float64, CSR
        With a symmetric pattern.
    dissection : Dissection
        Of its unknowns.

    Raises
    ------
    SolverError
        The matrix is not positive definite.
    """

    def __init__(self, matrix: sp.csr_array, dissection: Dissection) -> None:
        starts = dissection.starts.tolist()
        self._starts = dissection.starts[:-1]
        self._blocks = [slice(*ends) for ends in pairwise(starts)]
        self._inverses: list[NDArray[np.float64]] = []
        self._couplings: list[NDArray[np.float64]] = []
        self._borders: list[NDArray[np.int64]] = []
        self._parents = np.full(len(self._blocks), -1)
        self._eliminate(_Upper(matrix, dissection), _owner(dissection.starts))

    def _eliminate(self, upper: _Upper, owner: NDArray[np.int64]) -> None:
        n = len(owner)
        place = np.zeros(n, dtype=np.int64)
        waiting: list[list[tuple[NDArray[np.int64], NDArray[np.float64]]]] = [[] for _ in self._blocks]
        for number, block in enumerate(self._blocks):
            rows, columns, values = upper.entries(block)
            children, waiting[number] = waiting[number], []
            size = block.stop - block.start
            border = _border(block.stop, [columns, *(index for index, _ in children)])
            place[block] = np.arange(size)
            place[border] = np.arange(size, size + len(border))
            panel = np.zeros((size, size + len(border)))
            panel[rows - block.start, place[columns]] = values
            seen = [(place[index], int(np.searchsorted(index, block.stop)), rest) for index, rest in children]
            for at, own, rest in seen:
                panel[at[:own, None], at] -= rest[:own]
            inverse = _inverse_factor(panel[:, :size], n)
            coupling = inverse @ panel[:, size:]
            self._inverses.append(inverse)
            self._couplings.append(coupling)
            self._borders.append(border)
            if len(border):
                taken = coupling.T @ coupling
                for at, own, rest in seen:
                    later = at[own:] - size
                    taken[later[:, None], later] += rest[own:, own:]
                self._parents[number] = parent = owner[border[0]]
                waiting[parent].append((border, taken))

    def solve(self, right_hand_sides: NDArray[np.float64], *, overwrite: bool = False) -> NDArray[np.float64]:
        """Solve for (n,) or (n, q); the rows, and those of the solution, are in the dissection's order.

        With `overwrite` the solution takes the place of the right-hand sides. Blocks that no right-hand side
        reaches are passed over on the way up.
        """
        result = right_hand_sides if overwrite else np.array(right_hand_sides, dtype=np.float64, order="C")
        if len(result) == 0:
            return result
        filled = result != 0.0 if result.ndim == 1 else result.any(axis=1)
        pulled = np.logical_or.reduceat(filled, self._starts)
        for number, (block, border) in enumerate(zip(self._blocks, self._borders, strict=True)):
            if pulled[number]:
                result[block] = own = self._inverses[number] @ result[block]
                if len(border):
                    result[border] -= self._couplings[number].T @ own
                    pulled[self._parents[number]] = True
        for number in range(len(self._blocks) - 1, -1, -1):
            block, border = self._blocks[number], self._borders[number]
            own = result[block]
            if len(border):
                own = own - self._couplings[number] @ result[border]
            result[block] = self._inverses[number].T @ own
        return result


class _Upper:
    """The upper triangle of a matrix in the order of a dissection, by blocks of its rows."""

    def __init__(self, matrix: sp.csr_array, dissection: Dissection) -> None:
        n = matrix.shape[0]
        place = np.zeros(n, dtype=np.int64)
        place[dissection.order] = np.arange(n)
        ordered = matrix[dissection.order]
        ordered.sum_duplicates()
        row, column = np.repeat(np.arange(n), np.diff(ordered.indptr)), place[ordered.indices]
        kept = column >= row
        self._row, self._column, self._value = row[kept], column[kept], ordered.data[kept]
        count = np.concatenate([[0], np.cumsum(kept)])
        self._begin = count[ordered.indptr]

    def entries(self, block: slice) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
        """Return rows, columns and values of the entries in the rows of a block."""
        here = slice(self._begin[block.start], self._begin[block.stop])
        return self._row[here], self._column[here], self._value[here]


def _owner(starts: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the block of each unknown in its order."""
    return np.repeat(np.arange(len(starts) - 1), np.diff(starts))


def _border(stop: int, indices: list[NDArray[np.int64]]) -> NDArray[np.int64]:
    """Return all unknowns behind a block among some, each once, in their order."""
    found = np.concatenate(indices)
    found = np.sort(found[found >= stop])
    first = np.ones(len(found), dtype=bool)
    np.not_equal(found[1:], found[:-1], out=first[1:])
    return found[first]


def _inverse_factor(front: NDArray[np.float64], n: int) -> NDArray[np.float64]:
    """Return C^-1 of F = C C', of which the upper triangle is looked at."""
    # LAPACK reads columns first: the transpose of the rows, and their upper triangle as its lower.
    factor, failed = lapack.dpotrf(front.T, lower=1, clean=1)
    if failed:
        raise SolverError(f"A linear system of {n} unknowns is not positive definite.")
    return np.asarray(lapack.dtrtri(factor, lower=1, overwrite_c=1)[0])
