"""Small least squares problems between bounds."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from o3d_relief.errors import SolverError
from o3d_relief.linalg.solve import solve_direct

__all__ = ["box_minimum"]

_ROUNDS = 50
"""Of the active set, and 20 more for each unknown: each exchange may be a single one."""


def box_minimum(
    form: sp.csr_array, pull: NDArray[np.float64], upper: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Minimise x' form x / 2 - pull' x subject to 0 <= x <= upper, by a primal-dual active set.

    Where the active set comes back to one that it had before, which it may on a few inputs, only the worst
    violation of each round is exchanged from there on.

    Parameters
    ----------
    form : (n, n) sparse float64
        Symmetric positive definite.
    pull : (n,) float64
    upper : (n,) float64
        Greater than 0.

    Returns
    -------
    (n,) float64

    Raises
    ------
    SolverError
        A form that is not positive definite, or no active set that fulfils everything.

    Examples
    --------
    >>> box_minimum(sp.eye_array(3).tocsr(), np.array([-1.0, 0.5, 9.0]), np.array([1.0, 1.0, 2.0])).tolist()
    [0.0, 0.5, 2.0]
    """
    state = np.zeros(len(pull), dtype=np.int64)  # -1 on the lower bound, 1 on the upper, 0 between
    seen: set[bytes] = set()
    for _ in range(_ROUNDS + 20 * len(pull)):
        x = np.where(state > 0, upper, 0.0)
        free = state == 0
        rows = form[np.flatnonzero(free)]
        x[free] = solve_direct(rows[:, np.flatnonzero(free)], pull[free] - rows @ x)
        force = form @ x - pull  # positive where x is held up, negative where it is held down
        excess = np.where(free, np.maximum(-x, x - upper), state * force)
        wrong = excess > 1e-10 * (1.0 + upper)
        if not wrong.any():
            return np.clip(x, 0.0, upper)
        if state.tobytes() in seen:
            wrong = np.arange(len(x)) == excess.argmax()
        seen.add(state.tobytes())
        state = np.where(wrong, np.where(free, np.where(x < 0.0, -1, 1), 0), state)
    raise SolverError("The least squares problem between bounds could not be solved.")
