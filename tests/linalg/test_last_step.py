import numpy as np
import pytest
import scipy.sparse as sp
import scipy.sparse.linalg as sla
from membrane import obstacle

from o3d_relief.linalg.last_step import last_step
from o3d_relief.linalg.patches import Patches
from o3d_relief.linalg.refining import Refining


def nothing_more(x):
    return sp.csr_array((0, len(x))), np.zeros(0)


@pytest.fixture
def followed():
    """A path at its end in a space of patches, from which on single vertices move."""
    path, vertices = obstacle()
    refined = Refining(path, Patches(path.form, vertices, 100))
    for _ in range(50):
        path.advance(least_gap(path))
        if refined.settled(path.gap() / path.energy(path.x), 0.03):
            break
    refined.leave()
    return path


def least_gap(path):
    return 0.018 * path.energy(path.x)


def rest(path):
    return np.abs(path.imbalance(np.zeros(0, dtype=bool))).max()


def test_single_vertices_come_into_balance(followed):
    before, there = rest(followed), followed.x
    found = last_step(followed, there, nothing_more, least_gap(followed))
    assert rest(followed) < 0.5 * before
    assert followed.objective(found) < followed.objective(there)
    assert (found > followed.lower).all()


def test_what_further_rows_have_goes_back(followed):
    there = followed.x
    held = np.array([100, 700, 1100])

    def more(x):
        moved = held[x[held] != there[held]]
        return sp.eye_array(len(x)).tocsr()[moved], there[moved]

    found = last_step(followed, there, more, least_gap(followed))
    assert (found[held] == there[held]).all()
    others = np.setdiff1d(np.arange(len(there)), held)
    assert (found[others] == followed.x[others]).all()
    assert (followed.x[others] != there[others]).any()


def test_known_rows_are_kept(followed):
    there = followed.x
    one, other = 5, 6
    row = sp.csr_array(([1.0, -1.0], ([0, 0], [one, other])), shape=(1, len(there)))

    def more(x):  # holds the one end of a row that the other end alone would break
        moved = [one] if x[one] != there[one] else []
        return sp.eye_array(len(x)).tocsr()[moved], there[moved]

    followed.add(row, np.array([there[one] - there[other] - 1e-12]))
    followed.lack[:] = 0.0
    found = last_step(followed, there, more, least_gap(followed))
    assert found[one] - found[other] >= there[one] - there[other] - 1e-12


def test_a_row_that_was_broken_before_stops_nothing(followed):
    there = followed.x
    row = sp.eye_array(len(there)).tocsr()[[5]]
    followed.add(row, there[[5]] + 1.0)  # neither x keeps it
    followed.lack[:] = 0.0
    assert last_step(followed, there, nothing_more, least_gap(followed)) is not there


def test_what_is_never_well_leaves_all_as_it_was(followed):
    there = followed.x
    all_wrong = sp.eye_array(len(there)).tocsr(), there
    assert last_step(followed, there, lambda _: all_wrong, least_gap(followed)) is there


def test_nothing_becomes_worse(followed):
    better = np.asarray(sla.spsolve(followed.form.tocsc(), followed.pull))  # as if without bounds
    assert last_step(followed, better, nothing_more, least_gap(followed)) is better
