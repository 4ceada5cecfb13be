"""Smoothed aggregation multigrid: a preconditioner whose cost and memory grow linearly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
import scipy.sparse.linalg as sla
from numpy.typing import NDArray
from pyamg import amg_core
from pyamg.aggregation.aggregate import standard_aggregation

__all__ = ["Multigrid", "aggregates", "multigrid", "smoothed", "sorted_matrix"]

_STRONG = 0.05
"""Unknowns i and j may share an aggregate where |a_ij| is at least this share of sqrt(a_ii a_jj)."""

_SMOOTHING = 4.0 / 3.0
"""Factor of Jacobi's method, divided by a bound on the spectral radius, that smooths the interpolation."""

_COARSEST = 100
"""Unknowns up to which a dense inverse is taken."""

_LEAST_COARSENING = 0.8
"""Share of the unknowns left from which on another level would not pay."""

_RIDGE = 1e-13
"""Added to the scaled diagonal of the coarsest matrix, which is singular where the whole one is."""


@dataclass(frozen=True, kw_only=True, eq=False)
class _Level:
    """A matrix in two triangles that both hold its diagonal, and the way to the next coarser level."""

    lower: sp.csr_matrix
    upper: sp.csr_matrix
    diagonal: NDArray[np.float64]
    interpolation: sp.csr_matrix
    restriction: sp.csr_matrix


class Multigrid:
    """One symmetric V-cycle of smoothed aggregation multigrid (Vaněk, Mandel, Brezina 1996).

    A sweep of Gauss-Seidel forwards before and one backwards after the correction from the coarser level. The
    first starts from zero: it is the solution with the lower triangle, and what remains needs only
    the product with the upper one. No random vectors: the same matrix gives the same bytes.

    Parameters
    ----------
    matrix : (n, n) sparse float64
        Symmetric, with a positive diagonal.
    """

    def __init__(self, matrix: sp.csr_array) -> None:
        self._levels: list[_Level] = []
        current = sorted_matrix(matrix)
        while current.shape[0] > _COARSEST:
            filtered = _pulling(current)
            interpolation = smoothed(filtered, _gathered(filtered))
            if interpolation.shape[1] > _LEAST_COARSENING * current.shape[0]:
                break
            restriction = interpolation.T.tocsr()
            level = _Level(
                lower=_triangle(current, upper=False),
                upper=_triangle(current, upper=True),
                diagonal=current.diagonal(),
                interpolation=interpolation,
                restriction=restriction,
            )
            self._levels.append(level)
            current = sorted_matrix(restriction @ (current @ interpolation))
        self._coarsest = _Coarsest(current)

    def __call__(self, right_hand_side: NDArray[np.float64]) -> NDArray[np.float64]:
        """Find an approximate solution, (n,)."""
        return self._cycle(0, right_hand_side)

    def _cycle(self, depth: int, right_hand_side: NDArray[np.float64]) -> NDArray[np.float64]:
        if depth == len(self._levels):
            return self._coarsest.solve(right_hand_side)
        level = self._levels[depth]
        first = _substitute(level.lower, right_hand_side, backwards=False)
        # A x = (L + D) x + (D + U) x - D x, and (L + D) x is the right-hand side.
        scaled = level.diagonal * first
        rest = level.upper @ first
        np.subtract(scaled, rest, out=rest)
        correction = level.interpolation @ self._cycle(depth + 1, level.restriction @ rest)
        # The backward sweep from x + e: (D + U) x' = b - L x - L e, and b - L x is D x.
        scaled += np.multiply(level.diagonal, correction, out=rest)
        scaled -= level.lower @ correction
        return _substitute(level.upper, scaled, backwards=True)


class _Coarsest:
    """The exact solution on the coarsest level: dense, or by a sparse LU where coarsening came to an end."""

    def __init__(self, matrix: sp.csr_matrix) -> None:
        n = matrix.shape[0]
        diagonal = matrix.diagonal()
        self._scale = 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
        scaling = sp.dia_matrix((self._scale[None, :], [0]), shape=(n, n))
        ridge = sp.dia_matrix((np.where(diagonal > 0.0, _RIDGE, 1.0)[None, :], [0]), shape=(n, n))
        scaled = (scaling @ matrix @ scaling + ridge).tocsc()
        if n <= _COARSEST:
            self._inverse = la.inv(scaled.toarray()).__matmul__
        else:
            self._inverse = sla.splu(scaled, permc_spec="MMD_AT_PLUS_A").solve

    def solve(self, right_hand_side: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(self._scale * self._inverse(self._scale * right_hand_side))


def multigrid(matrix: sp.csr_array) -> sla.LinearOperator:
    """Build a preconditioner for a sparse symmetric positive definite matrix.

    Parameters
    ----------
    matrix : (n, n) sparse float64

    Returns
    -------
    LinearOperator
        One V-cycle, see `Multigrid`.
    """
    return sla.LinearOperator(matrix.shape, matvec=Multigrid(matrix), dtype=np.float64)


def sorted_matrix(matrix: sp.csr_array) -> sp.csr_matrix:
    """Return a matrix with sorted 32-bit indices: pyamg goes wrong with others, in silence."""
    parts = matrix.data, matrix.indices.astype(np.int32), matrix.indptr.astype(np.int32)
    result = sp.csr_matrix(parts, shape=matrix.shape)
    if not matrix.has_sorted_indices:
        result = result.sorted_indices()
    return result


def _rows(matrix: sp.csr_matrix) -> NDArray[np.int32]:
    """Return the row of each entry."""
    return np.repeat(np.arange(matrix.shape[0], dtype=np.int32), np.diff(matrix.indptr))


def _select(matrix: sp.csr_matrix, chosen: NDArray[np.bool_]) -> sp.csr_matrix:
    """Return a matrix with some of its entries only."""
    count = np.zeros(len(chosen) + 1, dtype=np.int32)
    np.cumsum(chosen, out=count[1:])
    return sp.csr_matrix(
        (matrix.data[chosen], matrix.indices[chosen], count[matrix.indptr]), shape=matrix.shape
    )


def _triangle(matrix: sp.csr_matrix, *, upper: bool) -> sp.csr_matrix:
    """Return the entries above, or below, the diagonal, and the diagonal."""
    rows = _rows(matrix)
    return _select(matrix, matrix.indices >= rows if upper else matrix.indices <= rows)


def _pulling(matrix: sp.csr_matrix) -> sp.csr_matrix:
    """Return a matrix with its strong negative couplings only; the others are added to the diagonal.

    Across obtuse angles couplings are positive: they push unknowns apart. An aggregate across them, or an
    interpolation, takes for smooth what is rough.
    """
    rows = _rows(matrix)
    root = np.sqrt(np.abs(matrix.diagonal()))
    itself = matrix.indices == rows
    kept = (-matrix.data >= _STRONG * root[rows] * root[matrix.indices]) | itself
    lost = np.bincount(rows, weights=np.where(kept, 0.0, matrix.data), minlength=matrix.shape[0])
    found = _select(matrix, kept)
    found.data[itself[kept]] += lost[rows[itself]]
    return found


def aggregates(matrix: sp.csr_matrix) -> sp.csr_matrix:
    """Gather strongly coupled unknowns: (n, a) float64, with at most one 1 in each row."""
    root = np.sqrt(np.abs(matrix.diagonal()))
    rows = _rows(matrix)
    strong = np.abs(matrix.data) >= _STRONG * root[rows] * root[matrix.indices]
    return _gathered(_select(matrix, strong | (matrix.indices == rows)))


def _gathered(matrix: sp.csr_matrix) -> sp.csr_matrix:
    """Gather unknowns by the graph of a matrix: (n, a) float64, with at most one 1 in each row."""
    found = standard_aggregation(matrix)[0]
    return sp.csr_matrix((np.ones(found.nnz), found.indices, found.indptr), shape=found.shape)


def smoothed(matrix: sp.csr_matrix, columns: sp.csr_matrix) -> sp.csr_matrix:
    """Smooth the columns of an interpolation, (n, a), once by Jacobi's method."""
    # The sum of a row's absolute values bounds the spectral radius row by row; an estimate from a random
    # vector would change the last digits from run to run.
    bound = np.bincount(_rows(matrix), weights=np.abs(matrix.data), minlength=matrix.shape[0])
    step = matrix @ columns
    step.data *= np.repeat(-_SMOOTHING / np.where(bound > 0.0, bound, 1.0), np.diff(step.indptr))
    return (columns + step).tocsr()


def _substitute(
    triangle: sp.csr_matrix, right_hand_side: NDArray[np.float64], *, backwards: bool
) -> NDArray[np.float64]:
    """Solve with a triangular matrix: one sweep of Gauss-Seidel, which then is exact."""
    n = len(right_hand_side)
    solution = np.zeros(n)
    sweep = (n - 1, -1, -1) if backwards else (0, n, 1)
    amg_core.gauss_seidel(triangle.indptr, triangle.indices, triangle.data, solution, right_hand_side, *sweep)
    return solution
