import numpy as np
import pytest
import scipy.sparse as sp

from o3d_relief.errors import SolverError
from o3d_relief.linalg.laplacian import cotangent_laplacian
from o3d_relief.linalg.newton import Everywhere, Within
from shapes import hills


def system(side=12):
    vertices, faces = hills(side)
    form, _ = cotangent_laplacian(vertices, faces)
    rng = np.random.default_rng(0)
    n = len(vertices)
    rows = sp.csr_array(rng.normal(size=(5, n)) * (rng.random((5, n)) < 0.1))
    return form, rng.uniform(0.1, 1.0, n), rows, rng.uniform(1.0, 1e3, 5), rng.normal(size=n)


def test_form_bounds_and_rows_add_up():
    form, diagonal, rows, stiff, b = system()
    x = Everywhere(form, None).prepare(diagonal, rows, stiff)(b)
    assert form @ x + diagonal * x + rows.T @ (stiff * (rows @ x)) == pytest.approx(b, abs=1e-9)


def test_within_a_space_the_rest_is_orthogonal_to_it():
    form, diagonal, rows, stiff, b = system()
    maps = sp.csr_array(np.random.default_rng(1).normal(size=(len(b), 7)))
    x = Within(form, maps).prepare(diagonal, rows, stiff)(b)
    assert np.linalg.lstsq(maps.toarray(), x, rcond=None)[1] == pytest.approx(0.0, abs=1e-12)
    rest = form @ x + diagonal * x + rows.T @ (stiff * (rows @ x)) - b
    assert maps.T @ rest == pytest.approx(0.0, abs=1e-8)
    assert np.abs(rest).max() > 0.1


def test_singular_systems_are_refused():
    form, _, rows, _, b = system()
    with pytest.raises(SolverError, match="144 unknowns"):
        Everywhere(sp.csr_array(0.0 * form), None).prepare(np.zeros(len(b)), rows[:0], np.zeros(0))


def test_a_space_gives_the_same_in_whatever_order_its_unknowns_come():
    form, diagonal, rows, stiff, b = system()
    maps = sp.csr_array(np.random.default_rng(1).normal(size=(len(b), 7)))
    within = Within(form, maps)
    first = within.prepare(diagonal, rows, stiff)
    x = first(b)
    # The second system is set up with the unknowns in the order of the first one's factor.
    assert within.prepare(diagonal, rows, stiff)(b) == pytest.approx(x, abs=1e-9)
    assert first(b) == pytest.approx(x, abs=1e-12)


@pytest.mark.parametrize(
    "kind", [lambda form: Everywhere(form, None), lambda form: Within(form, sp.eye_array(576).tocsr())]
)
def test_unknowns_are_ordered_anew_when_rows_have_filled_the_factor(kind):
    form, diagonal, _, _, b = system(24)
    n = len(b)
    newton = kind(form)
    far = np.random.default_rng(2).permutation(n)[:120]
    rows = sp.coo_array((np.ones(120), (np.repeat(np.arange(60), 2), far)), shape=(60, n)).tocsr()
    for some in (rows[:0], rows[:1], rows, rows):
        stiff = np.full(some.shape[0], 10.0)
        x = newton.prepare(diagonal, some, stiff)(b)
        assert form @ x + diagonal * x + some.T @ (stiff * (some @ x)) == pytest.approx(b, abs=1e-9)
