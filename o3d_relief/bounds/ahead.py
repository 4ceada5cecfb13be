"""What keeping the order needs of a scene, found while its heights are still being made."""

from __future__ import annotations

from concurrent.futures import Executor

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from o3d_relief.bounds.between import Between
from o3d_relief.bounds.columns import column_pairs
from o3d_relief.bounds.lines import Lines
from o3d_relief.bounds.pairs import Pairs, close_pairs
from o3d_relief.bounds.silhouettes import edges_that_turn, silhouette_pairs
from o3d_relief.linalg.laplacian import vertex_areas
from o3d_relief.memory import give_back

__all__ = ["Ahead"]

_LINES = 256
"""Lines along x and along y on which the order is kept, besides those through vertices and crossings."""


class Ahead:
    """Finds what depends on the scene alone, in another thread.

    Whoever asks for anything waits until it is there. An error of the other thread is raised then. The
    silhouettes are looked at from the start: they need much memory, as the construction does later on.

    Parameters
    ----------
    thread : Executor
        Does one thing after the other.
    vertices : (n, 3) float64
        In the relief frame, in relief units.
    faces : (m, 3) int64
    """

    def __init__(self, thread: Executor, vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> None:
        self._thread, self._vertices, self._faces = thread, vertices, faces
        self._turns = thread.submit(edges_that_turn, vertices, faces)
        self._silhouettes = thread.submit(lambda: silhouette_pairs(vertices, faces, self._turns.result()))
        self._areas = thread.submit(vertex_areas, vertices, faces)
        thread.submit(give_back)

    def stack(self, lines: Lines, stacked: Pairs, laplacian: sp.csr_array, *, fine: bool) -> None:
        """Go on with what needs more than the mesh.

        Parameters
        ----------
        lines : Lines
            Of the mesh; nobody else may use it from now on.
        stacked : Pairs
            At the vertices.
        laplacian : (n, n) sparse float64
            The cotangent Laplacian, whose graph tells the parts.
        fine : bool
            Keep the order on four times as many lines along x and along y: a gap need not be least at
            vertices and silhouettes.
        """
        silhouettes = self._silhouettes.result()

        def pairs() -> Pairs:
            grid = column_pairs(lines, side=4 * _LINES if fine else _LINES)
            return Pairs.join([stacked, silhouettes, close_pairs(lines), grid])

        self._pairs = self._thread.submit(pairs)
        self._between = self._thread.submit(
            lambda: Between(self._vertices, self._faces, laplacian, self._turns.result()[0])
        )
        self._thread.submit(give_back)

    @property
    def areas(self) -> NDArray[np.float64]:
        """The area of each vertex, (n,)."""
        return self._areas.result()

    @property
    def pairs(self) -> Pairs:
        """What must stay in order, on all lines; after `stack`."""
        return self._pairs.result()

    @property
    def between(self) -> Between:
        """What looks for what is out of order between the lines; after `stack`."""
        return self._between.result()
