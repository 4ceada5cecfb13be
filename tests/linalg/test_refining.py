import pytest
from membrane import obstacle

from o3d_relief.linalg import refining
from o3d_relief.linalg.patches import Patches
from o3d_relief.linalg.refining import Refining


def follow(path, refined=None, *, accuracy=0.02, rounds=50):
    """Follow a path until its gap, and what the space costs, are small; return a bound on the objective."""
    for _ in range(rounds):
        path.advance(0.3 * accuracy * path.energy(path.x))
        share = path.gap() / path.energy(path.x)
        if refined is None and share <= accuracy:
            return path.least()
        if refined is not None and refined.settled(share, accuracy):
            least = path.least() - refined.cost()
            if path.objective(path.x) - least <= accuracy * path.energy(path.x):
                return least
    raise AssertionError("the path has not come to its end")


def test_the_refined_space_has_the_minimum_of_the_whole():
    whole, _ = obstacle()
    least = follow(whole, accuracy=1e-6)
    path, vertices = obstacle()
    refined = Refining(path, Patches(path.form, vertices, 20))
    bound = follow(path, refined)
    assert bound <= least <= path.objective(path.x)
    assert path.objective(path.x) - least <= 0.02 * path.energy(path.x)
    assert (path.x > path.lower).all()


def test_a_space_that_stays_coarse_is_found_out():
    path, vertices = obstacle()
    refined = Refining(path, Patches(path.form, vertices, 20))
    for _ in range(30):
        path.advance(1e-3 * path.energy(path.x))
    assert path.gap() < 2e-3 * path.energy(path.x)
    assert refined.cost() > 0.05 * path.energy(path.x)
    assert not refined.settled(path.gap() / path.energy(path.x), 0.02)


def test_forces_of_a_wide_gap_are_not_looked_at():
    path, vertices = obstacle()
    refined = Refining(path, Patches(path.form, vertices, 20))
    columns = path.newton
    assert not refined.settled(0.9, 0.02)
    assert path.newton is columns


@pytest.mark.parametrize("most", [20, 10**6])
def test_cost_is_zero_for_all_unknowns_only(most):
    path, vertices = obstacle(20)
    refined = Refining(path, Patches(path.form, vertices, most))
    for _ in range(25):
        path.advance(1e-4 * path.energy(path.x))
    cost = refined.cost() / path.energy(path.x)
    assert cost < 1e-6 if most > 400 else cost > 1e-3


def test_what_single_vertices_do_not_tell_is_made_up_for():
    path, vertices = obstacle()
    patches = Patches(path.form, vertices, 20)
    refined = Refining(path, patches)
    for _ in range(30):
        path.advance(1e-3 * path.energy(path.x))
    share, cost = path.gap() / path.energy(path.x), refined.cost() / path.energy(path.x)
    accuracy = 0.9 * cost / refining._MISSING
    refined = Refining(path, patches)
    space = path.newton
    assert refined.settled(share, accuracy)  # as far as they tell, this space will do
    assert path.newton is space
    refined.cost()
    assert not refined.settled(share, accuracy)
    assert path.newton is not space
