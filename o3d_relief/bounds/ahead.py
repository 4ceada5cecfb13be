"""What keeping the order needs of a scene, found while its heights are still being made."""

from __future__ import annotations

from concurrent.futures import Executor

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from o3d_relief.bounds.between import Between
from o3d_relief.bounds.columns import column_pairs
from o3d_relief.bounds.lines import Lines
from o3d_relief.bounds.pairs import Pairs, close_pairs, vertex_pairs
from o3d_relief.bounds.parts import PartSprings, find_springs
from o3d_relief.bounds.silhouettes import edges_that_turn, silhouette_pairs
from o3d_relief.linalg.laplacian import vertex_areas

__all__ = ["Ahead"]


class Ahead:
    """Finds what depends on the scene alone, in another thread, in the order in which it is needed.

    Whoever asks for anything waits until it is there. An error of the other thread is raised then.

    Parameters
    ----------
    thread : Executor
        Does one thing after the other.
    vertices : (n, 3) float64
        In the relief frame, in relief units.
    faces : (m, 3) int64
    laplacian : (n, n) sparse float64
        The cotangent Laplacian, whose graph tells the parts.
    lines : Lines
        Of the mesh; nobody else may use it.
    side : int
        Lines of a grid along x and along y on which the order is kept, besides those through vertices and
        crossings.
    """

    def __init__(
        self,
        thread: Executor,
        vertices: NDArray[np.float64],
        faces: NDArray[np.int64],
        laplacian: sp.csr_array,
        lines: Lines,
        *,
        side: int,
    ) -> None:
        def springs() -> PartSprings | None:
            return find_springs(vertices, faces, laplacian, stacked.result())

        def pairs() -> Pairs:
            silhouettes = silhouette_pairs(vertices, faces, turns.result())
            grid = column_pairs(lines, side=side)
            return Pairs.join([stacked.result(), silhouettes, close_pairs(lines), grid])

        def between() -> Between:
            return Between(vertices, faces, laplacian, turns.result()[0])

        stacked = thread.submit(vertex_pairs, lines)
        self._springs = thread.submit(springs)
        turns = thread.submit(edges_that_turn, vertices, faces)
        self._pairs = thread.submit(pairs)
        self._areas = thread.submit(vertex_areas, vertices, faces)
        self._between = thread.submit(between)

    @property
    def springs(self) -> PartSprings | None:
        """What ties the parts of the scene to each other, None where it is one."""
        return self._springs.result()

    @property
    def pairs(self) -> Pairs:
        """What must stay in order, on all lines."""
        return self._pairs.result()

    @property
    def areas(self) -> NDArray[np.float64]:
        """The area of each vertex, (n,)."""
        return self._areas.result()

    @property
    def between(self) -> Between:
        """What looks for what is out of order between the lines."""
        return self._between.result()
