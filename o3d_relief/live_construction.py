"""The construction for any heights of any of its points, without solving it anew."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from o3d_relief.bounds.parts import PartSprings
from o3d_relief.linalg.factor import Factor
from o3d_relief.linalg.responses import Responses
from o3d_relief.memory import memory_kept
from o3d_relief.progress import NOBODY, Progress
from o3d_relief.stages.construction import leaders

__all__ = ["LiveConstruction"]

_REMEMBERED = 4
"""Systems of scenes of several tied parts that are kept, for as many choices of the parts that are held."""


@dataclass(frozen=True, kw_only=True, eq=False)
class _Held:
    """What depends on which components hold a kept point, and on nothing else.

    Attributes
    ----------
    responses : Responses
        Of the components that do, to `points`.
    points : (c,) int64
        The attenuation points among those given whose responses they are.
    pull : (n, s) sparse or None
        What the springs among these components pull with, by the changes of all springs.
    loose : _Loose or None
        Components that springs make follow.
    alone : (n,) bool
        Vertices of the components that nothing ties.
    leader : (l,) int64
        The vertex that each of these follows.
    """

    responses: Responses
    points: NDArray[np.int64]
    pull: sp.csr_array | None
    loose: _Loose | None
    alone: NDArray[np.bool_]
    leader: NDArray[np.int64]


@dataclass(frozen=True, kw_only=True, eq=False)
class _Loose:
    """The system of the components that follow: A_ll d_l = pull - A_lh d_h."""

    index: NDArray[np.int64]
    factor: Factor
    rows: sp.csr_array
    pull: sp.csr_array


class LiveConstruction:
    """The construction of the pipeline (Eqs. 6, 7) as a function of its points, for one set of them.

    Equal to `o3d_relief.stages.construction.construct` with the same points to 1e-6 of the extent. On a
    mesh of one component, or where parts are not tied, any change is a product with the responses. Where
    springs tie several parts, a change of their rest lengths is one more substitution with the kept
    factors, and where other components than before hold a kept point the system is another one: its
    responses are found anew, and those of the last few are remembered.

    Parameters
    ----------
    vertices : (n, 3) float64
        In the relief frame, in relief units.
    laplacian : (n, n) sparse float64
        The cotangent Laplacian.
    index : (p,) int64
        The attenuation points.
    springs : PartSprings or None
        What ties the parts of a scene, if anything does.
    progress : Progress
        Told of the responses whenever they are computed; may call the work off.

    Raises
    ------
    SolverError
        A system is singular or not positive definite.
    """

    def __init__(
        self,
        vertices: NDArray[np.float64],
        laplacian: sp.csr_array,
        index: NDArray[np.int64],
        springs: PartSprings | None,
        progress: Progress = NOBODY,
    ) -> None:
        self._progress = progress
        self._vertices = vertices
        self._laplacian = laplacian
        self._index = index
        self._springs = springs
        _, self._label = connected_components(laplacian, directed=False)
        self._systems: dict[bytes, _Held] = {}
        if springs is None:
            self._untied = self._responses(laplacian, np.arange(len(index)))

    @property
    def springs(self) -> PartSprings | None:
        """What ties the parts, None for one part or parts that are not tied."""
        return self._springs

    def heights(
        self,
        kept: NDArray[np.bool_],
        new_height: NDArray[np.float64],
        shrink: NDArray[np.float64] | None = None,
    ) -> NDArray[np.float64]:
        """Find the z of all vertices.

        Parameters
        ----------
        kept : (p,) bool
            The points that are fixed, at least one.
        new_height : (p,) float64
            Their z; NaN for the others.
        shrink : (len(springs.stacked),) float64, optional
            The gaps of the stacked pairs at rest, where there are springs.

        Returns
        -------
        (n,) float64
        """
        z = self._vertices[:, 2]
        held_labels = np.unique(self._label[self._index[kept]])
        system = self._system(held_labels)
        points = system.points
        moved = np.where(kept, new_height - z[self._index], 0.0)[points]
        # A component without a kept point is no matter of the responses.
        released = (~kept & np.isin(self._label[self._index], held_labels))[points]
        if self._springs is None or shrink is None or system.pull is None:
            displacement = system.responses.displacement(moved, released)
        else:
            change = self._springs.change(shrink)
            displacement = system.responses.displacement(moved, released, system.pull @ change)
            if (loose := system.loose) is not None:
                displacement[loose.index] = 0.0
                force = (loose.pull @ change)[loose.index] - loose.rows @ displacement
                displacement[loose.index] = loose.factor.solve(force)
        displacement[system.alone] = displacement[system.leader]
        result = z + displacement
        result[self._index[kept]] = new_height[kept]
        return np.asarray(result)

    def _system(self, held_labels: NDArray[np.int32]) -> _Held:
        key = held_labels.tobytes()
        if key in self._systems:
            self._systems[key] = self._systems.pop(key)  # the last one used is forgotten last
            return self._systems[key]
        held = np.isin(self._label, held_labels)
        found = self._alone(held) if self._springs is None else self._tied(held, self._springs)
        self._systems[key] = found
        while len(self._systems) > _REMEMBERED:
            self._systems.pop(next(iter(self._systems)))
        return found

    def _alone(self, held: NDArray[np.bool_]) -> _Held:
        return _Held(
            responses=self._untied,
            points=np.arange(len(self._index)),
            pull=None,
            loose=None,
            alone=~held,
            leader=leaders(self._vertices, self._label, held),
        )

    def _tied(self, held: NDArray[np.bool_], springs: PartSprings) -> _Held:
        among_loose = springs.loose(held)
        form, pull = springs.system(~among_loose)
        points = np.flatnonzero(held[self._index])
        responses = self._responses((self._laplacian + form).tocsr(), points, keep_factor=True)
        loose_form, loose_pull = springs.system(among_loose, following=True)
        coupled = (self._laplacian + loose_form).tocsr()
        _, group = connected_components(coupled, directed=False)
        known = np.isin(group, group[held])
        return _Held(
            responses=responses,
            points=points,
            pull=_spread(pull, ~among_loose),
            loose=self._following(coupled, known & ~held, _spread(loose_pull, among_loose)),
            alone=~known,
            leader=leaders(self._vertices, self._label, known),
        )

    def _following(
        self, coupled: sp.csr_array, loose: NDArray[np.bool_], pull: sp.csr_array
    ) -> _Loose | None:
        index = np.flatnonzero(loose)
        if len(index) == 0:
            return None
        rows = coupled[index]
        factor = Factor(rows[:, index].tocsr(), self._vertices[index])
        return _Loose(index=index, factor=factor, rows=rows, pull=pull)

    @memory_kept()
    def _responses(
        self, form: sp.csr_array, points: NDArray[np.int64], *, keep_factor: bool = False
    ) -> Responses:
        index = self._index[points]
        free = np.isin(self._label, self._label[index])
        free[index] = False
        self._progress.begin("responses")
        found = Responses(
            form, self._vertices, index, free, keep_factor=keep_factor, tick=self._progress.tick
        )
        self._progress.end()
        return found


def _spread(columns: sp.csr_array, chosen: NDArray[np.bool_]) -> sp.csr_array:
    """Give the columns of some springs their places among those of all."""
    found = columns.tocoo()
    place = np.flatnonzero(chosen)[found.col]
    return sp.coo_array((found.data, (found.row, place)), shape=(columns.shape[0], len(chosen))).tocsr()
