"""What is out of order between the lines that are looked along."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from o3d_relief.bounds.crossings import edges_of
from o3d_relief.bounds.cuts import cut_crossings
from o3d_relief.bounds.gaps import out_of_order
from o3d_relief.bounds.hinges import hinged_pairs
from o3d_relief.bounds.new_crossings import new_crossings
from o3d_relief.bounds.pairs import Pairs, foot_pairs
from o3d_relief.bounds.parted import Parted
from o3d_relief.bounds.raster import Raster

__all__ = ["Between"]


class Between:
    """Looks for edges that have begun to pierce triangles, and for what changed places where S cuts it."""

    def __init__(
        self,
        vertices: NDArray[np.float64],
        faces: NDArray[np.int64],
        laplacian: sp.csr_array,
        edges: NDArray[np.int64] | None = None,
    ) -> None:
        self._vertices, self._faces = vertices, faces
        self._edges = edges_of(faces) if edges is None else edges
        self._raster = Raster(vertices, faces)
        self._corners, self._ends = np.ascontiguousarray(faces.T), np.ascontiguousarray(self._edges.T)
        self._parted = Parted(vertices, faces, laplacian, self._raster)
        self.forget()

    def forget(self) -> None:
        """Look everywhere the next time, not only where something has moved."""
        self._last = np.full(len(self._vertices), np.nan)
        self._not_closer = np.ones(len(self._faces), dtype=bool)
        self._parted.forget()

    def look_at(self, z: NDArray[np.float64]) -> tuple[Pairs, int]:
        """Return pairs that keep apart what was found, and how much it was, where something has moved."""
        vertices, faces = self._vertices, self._faces
        moved = z != self._last
        self._last = z
        a, b, c = self._corners
        changed = moved[a] | moved[b] | moved[c]
        if changed.all():
            near, edges = changed, self._edges
            looked = [new_crossings(vertices, faces, edges, z)]
        else:
            near = self._raster.over_or_under(changed)
            at = np.zeros(len(z), dtype=bool)
            at[faces[near]] = True
            first, last = self._ends
            edges = self._edges[at[first] & at[last]]
            # Edges that moved may pierce what lies near; the others, triangles that moved.
            own = moved[edges[:, 0]] | moved[edges[:, 1]]
            looked = [new_crossings(vertices, faces[near], edges[own], z)]
            if not own.all():
                looked.append(new_crossings(vertices, faces[changed], edges[~own], z))
        self._not_closer |= near
        in_front, behind = z > 0.0, z < 0.0
        cut = near & (in_front[a] | in_front[b] | in_front[c]) & (behind[a] | behind[b] | behind[c])
        at_foot = foot_pairs(vertices, faces[near & self._raster.over_or_under(cut)], edges, z)
        found = Pairs.join([*(pairs for pairs, _ in looked), at_foot])
        return found, sum(count for _, count in looked) + len(at_foot)

    def look_closer(self, z: NDArray[np.float64], swapped: Pairs) -> tuple[Pairs, int]:
        """Return pairs for what is rare: it hangs together over S, stands at the cut, or crossed before.

        Of the pairs on lines, those that have changed places behind S are enough. Call `look_at` before.
        """
        hinged = hinged_pairs(self._vertices, self._faces, swapped, z)
        parted = self._parted.look_at(z)
        parted = parted.select(out_of_order(parted, z))
        cut, count = cut_crossings(self._vertices, self._faces, self._raster, z, among=self._not_closer)
        if count == 0:
            self._not_closer[:] = False
        return Pairs.join([hinged, parted, cut]), len(hinged) + len(parted) + count
