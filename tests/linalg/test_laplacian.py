import numpy as np
import pytest

import oracle
from o3d_relief.linalg.laplacian import cotangent_laplacian, mended_cotangents
from shapes import bust, grid, hills


def test_agrees_with_the_literal_appendix():
    for shape in (hills(9), grid(6)):
        laplacian, slivers = cotangent_laplacian(*shape)
        assert slivers == 0
        assert laplacian.toarray() == pytest.approx(oracle.cotangent_matrix(shape), abs=1e-12)


def test_symmetric_with_zero_row_sums_and_never_negative():
    laplacian, _ = cotangent_laplacian(*bust(16))
    assert abs(laplacian - laplacian.T).max() == 0.0
    assert abs(laplacian.sum(axis=1)).max() < 1e-12
    assert np.linalg.eigvalsh(laplacian.toarray()).min() > -1e-12


def test_does_not_depend_on_the_scale():
    vertices, faces = hills(9)
    here, _ = cotangent_laplacian(vertices, faces)
    there, _ = cotangent_laplacian(vertices * 1e-6, faces)
    assert there.toarray() == pytest.approx(here.toarray(), rel=1e-9)


def test_renumbering_commutes():
    vertices, faces = hills(9)
    order = np.random.default_rng(1).permutation(len(vertices))
    number = np.argsort(order)
    here, _ = cotangent_laplacian(vertices, faces)
    there, _ = cotangent_laplacian(vertices[order], number[faces])
    assert there.toarray() == pytest.approx(here.toarray()[np.ix_(order, order)], abs=1e-12)


@pytest.mark.parametrize(
    "triangle",
    [
        [[0, 0, 0], [1, 0, 0], [2, 0, 0]],
        [[0, 0, 0], [1, 0, 0], [1 + 1e-9, 1e-9, 0]],
        [[0, 0, 0], [1, 1e-12, 0], [2, 0, 0]],
        [[0, 0, 0], [1, 0, 0], [0, 0, 0]],
    ],
)
def test_slivers_stay_bounded_and_positive(triangle):
    cotangents, slivers = mended_cotangents(np.array(triangle, dtype=float), np.array([[0, 1, 2]]))
    assert slivers == 1
    assert np.abs(cotangents).max() < 1001
    a, b, c = cotangents[0]
    # The cotangents of three angles that add up to 180 degrees: the mended face is a triangle.
    assert a * b + b * c + c * a == pytest.approx(1.0, rel=1e-6)


def test_equilateral_triangle():
    triangle = np.array([[0, 0, 0], [2, 0, 0], [1, np.sqrt(3), 0]])
    cotangents, slivers = mended_cotangents(triangle, np.array([[0, 1, 2]]))
    assert cotangents[0] == pytest.approx([1 / np.sqrt(3)] * 3)
    assert slivers == 0
