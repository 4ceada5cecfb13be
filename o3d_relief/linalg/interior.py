"""Quadratic programs with many linear inequalities, by an interior point method."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from o3d_relief.linalg.central_path import CentralPath
from o3d_relief.linalg.last_step import last_step
from o3d_relief.linalg.one_thread import one_thread
from o3d_relief.linalg.patches import Patches
from o3d_relief.linalg.refining import Refining
from o3d_relief.progress import Tick, share_of_way, silent

__all__ = ["Minimum", "minimise"]

_CHECK_EVERY = 3
"""Rounds after which further rows are asked for; one less at the end."""

_CENTRAL = 0.6
"""Gap below which the iteration does not aim, as a share of the accuracy: from well inside of all constraints
it is not far to where rows that come later hold, too."""

_SOME_ROOM = 0.2
"""Room that further rows are given on the way back, as a share of what they have where all is well."""

_ROUNDS = 80

_LARGE = 60_000
"""Unknowns from which on the steps are taken from a space that is coarse at first."""

_FIRST_PATCHES = 5000
"""Patches that span this space, at most."""

_CHECK_FROM = 0.08
"""Gap, as a share of the energy, from which on rounds in such a space, which are many and cheap, are worth a
check."""

Vector = NDArray[np.float64]
MoreRows = Callable[[Vector], tuple[sp.csr_array, Vector]]


@dataclass(frozen=True, kw_only=True, eq=False)
class Minimum:
    """The minimum of a quadratic program.

    Attributes
    ----------
    x : (n,) float64
        Strictly inside every constraint.
    rounds : int
        Linear systems solved.
    watched : int
        Rows that took part.
    gap : float
        Bound on how far the objective is above its minimum, as a share of (x - o)' H (x - o) / 2.
    """

    x: Vector
    rounds: int
    watched: int
    gap: float


def minimise(
    form: sp.csr_array,
    pull: Vector,
    *,
    origin: Vector,
    start: Vector,
    lower: Vector,
    upper: Vector,
    rows: sp.csr_array,
    bound: Vector,
    more_rows: MoreRows,
    positions: NDArray[np.float64] | None = None,
    in_patches: bool = True,
    accuracy: float = 0.03,
    tick: Tick = silent,
) -> Minimum:
    """Minimise (x - o)' H (x - o) / 2 - pull' x  subject to  lower <= x <= upper  and  R x >= bound.

    A primal-dual interior point method with Mehrotra's corrections. Each round solves one linear system, H
    plus springs on the constraints, for two right-hand sides. Of the rows only those that a step has come
    near take part in the systems; all of them limit the steps. Whether more rows are needed is asked every
    few rounds, and the iterate may break these for a while: it goes on from where it is. Many unknowns move
    in patches at first, which are divided where the minimum needs it.

    Parameters
    ----------
    form : (n, n) sparse float64
        H, positive semi-definite, and definite together with the bounds.
    pull : (n,) float64
    origin : (n,) float64
        o.
    start : (n,) float64
        Strictly inside all constraints.
    lower, upper : (n,) float64
        Infinite where there is no bound.
    rows : (p, n) sparse float64
        R.
    bound : (p,) float64
    more_rows : callable
        Given an x, returns further rows and bounds that `start` is strictly inside of, none when all is well.
        Asked now and then, and at the end: only an x with which all is well is returned, or `start`.
    positions : (n, 3) float64, optional
        Of the vertices that the unknowns belong to: factors are then found faster.
    in_patches : bool
        Gather more than 60,000 unknowns that have positions in patches.
    accuracy : float
        Gap between the objective and its dual, as a share of (x - o)' H (x - o) / 2, at which the iteration
        stops.
    tick : callable, optional
        Called in every round with the share of the way from the first gap to `accuracy`; it may raise to end
        the work.

    Returns
    -------
    Minimum
    """
    with one_thread():  # sums that do not depend on the number of threads
        path = CentralPath(form, pull, origin, start, lower, upper, rows, bound, positions)
        refining = None
        if in_patches and positions is not None and len(pull) > _LARGE:
            refining = Refining(path, Patches(form, positions, _FIRST_PATCHES))
        accepted, least = _run(path, refining, accuracy, more_rows, tick)
    share = (path.objective(accepted) - least) / max(path.energy(accepted), 1e-300)
    return Minimum(x=accepted, rounds=path.rounds, watched=len(path.lack), gap=share)


def _run(
    path: CentralPath, refining: Refining | None, accuracy: float, more_rows: MoreRows, tick: Tick
) -> tuple[Vector, float]:
    """Follow the path to a place where all is well; return it, and a bound from below on the objective."""
    accepted, next_check, least = path.x, _CHECK_EVERY, -np.inf
    first_share = path.gap() / max(path.energy(path.x), 1e-300)
    while path.rounds < _ROUNDS:
        path.advance(_CENTRAL * accuracy * path.energy(path.x))
        share, least = path.gap() / max(path.energy(path.x), 1e-300), path.least()
        tick(share_of_way(first_share, share, accuracy))
        close, due = share <= accuracy, path.rounds >= next_check
        if refining is not None:
            least = least - refining.cost() if refining.settled(share, accuracy) else -np.inf
            close = path.objective(path.x) - least <= accuracy * path.energy(path.x)
            due &= share <= _CHECK_FROM
        # As long as known rows are broken, all is hardly well.
        if due or (close and not path.lacking.any()):
            accepted = _check(path, accepted, more_rows)
            # Rows that have just come can only raise the minimum.
            if path.objective(accepted) - least <= accuracy * path.energy(accepted):
                break
            next_check = path.rounds + _CHECK_EVERY - close
    if refining is None:
        return accepted, least
    if not np.isfinite(least):
        least = path.least() - refining.cost()
    refining.leave()
    return last_step(path, accepted, more_rows, _CENTRAL * accuracy * path.energy(path.x)), least


def _check(path: CentralPath, accepted: Vector, more_rows: MoreRows) -> Vector:
    """Return x where all is well; else add rows, and return the better of two others where it is."""
    rows, bound = more_rows(path.x)
    if len(bound) == 0:
        return path.x
    here, there = rows @ path.x - bound, rows @ accepted - bound
    wanted = _SOME_ROOM * there
    short = here < np.minimum(wanted, there)
    share = float(((wanted - here)[short] / (there - here)[short]).max(initial=0.0))
    nearer = path.x + share * (accepted - path.x)
    path.add(rows, bound)
    # Where the rounds may not suffice, the way back is worth a look.
    if path.rounds > _ROUNDS // 2 and share < 1.0 and path.objective(nearer) < path.objective(accepted):
        further = more_rows(nearer)[1]
        return nearer if len(further) == 0 else accepted
    return accepted
