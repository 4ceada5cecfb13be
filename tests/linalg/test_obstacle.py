import numpy as np
import pytest
import scipy.sparse as sp
from threadpoolctl import threadpool_limits

from o3d_relief import cotangent_laplacian
from o3d_relief.linalg.obstacle import minimise_above
from o3d_relief.linalg.quadratic import minimise
from o3d_relief.linalg.solve import solve_spd
from shapes import hills


def _problem(side, seed=0, deep=1.0):
    """A membrane and plate, held at one corner, that is pulled down onto hills below it."""
    vertices, faces = hills(side)
    laplacian, _ = cotangent_laplacian(vertices, faces)
    first = laplacian[1:][:, 1:].tocsr()
    matrix = (0.9 * first + 0.1 * first @ sp.diags_array(1.0 / first.diagonal()) @ first).tocsr()
    pull = -0.5 * np.random.default_rng(seed).random(first.shape[0])
    lowest = deep * vertices[1:, 2] - 3.0
    lowest[::7] = -np.inf
    return matrix, first, pull, lowest


@pytest.mark.parametrize("side", [12, 40])
@pytest.mark.parametrize("deep", [0.0, 1.0, 5.0])
def test_agrees_with_the_interior_point_method(side, deep):
    matrix, first, pull, lowest = _problem(side, deep=deep)
    found = minimise_above(matrix, pull, lowest, similar=first, error=1e-6)
    bounded = np.isfinite(lowest)
    rows = sp.eye_array(len(pull), format="csr")[bounded]
    expected = minimise(matrix, pull, rows, lowest[bounded], tolerance=1e-10)
    assert found.x == pytest.approx(expected, abs=1e-4)
    assert found.on_bound.any()


@pytest.mark.parametrize("side", [20, 50, 90])
def test_what_is_held_is_pushed_and_the_rest_is_free(side):
    matrix, first, pull, lowest = _problem(side)
    found = minimise_above(matrix, pull, lowest, similar=first, error=1e-6)
    force = matrix @ found.x - pull
    free = ~found.on_bound
    assert found.on_bound.any()
    assert free.any()
    assert (found.x >= lowest).all()
    assert found.x[found.on_bound].tolist() == lowest[found.on_bound].tolist()
    assert force[found.on_bound].min() > -1e-4
    assert np.abs(force[free]).max() < 1e-4


def test_without_bounds_it_is_the_linear_system():
    matrix, first, pull, _ = _problem(40)
    found = minimise_above(matrix, pull, np.full(len(pull), -np.inf), similar=first, error=1e-6)
    assert found.x.tobytes() == solve_spd(matrix, pull, similar=first, error=1e-6).tobytes()
    assert found.rounds == 1


def test_everything_on_its_bound():
    matrix, first, pull, _ = _problem(40)
    lowest = np.full(len(pull), 2.0)
    lowest[0] = 2.5
    found = minimise_above(matrix, pull - 100.0, lowest, similar=first, error=1e-6)
    assert found.x.tolist() == lowest.tolist()


def test_same_bytes_whatever_the_number_of_threads():
    problem = _problem(90)

    def solve():
        matrix, first, pull, lowest = problem
        return minimise_above(matrix, pull, lowest, similar=first, error=1e-6).x.tobytes()

    with threadpool_limits(limits=1):
        once = solve()
    assert solve() == once
