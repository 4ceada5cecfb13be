import numpy as np
import pytest
import scipy.sparse as sp

from o3d_relief.errors import SolverError
from o3d_relief.linalg.laplacian import cotangent_laplacian
from o3d_relief.linalg.rough import RoughSolver
from o3d_relief.progress import silent
from shapes import hills


def membrane(n):
    vertices, faces = hills(n)
    laplacian, _ = cotangent_laplacian(vertices, faces)
    return (laplacian + 1e-3 * sp.eye_array(len(vertices))).tocsr()


def test_few_unknowns_are_solved_for_exactly():
    matrix = membrane(30)
    b = np.random.default_rng(0).normal(size=matrix.shape[0])
    x = RoughSolver(silent).prepare(matrix)(b)
    assert matrix @ x == pytest.approx(b, abs=1e-9)


def test_many_unknowns_are_solved_for_roughly():
    matrix = membrane(200)
    b = np.random.default_rng(0).normal(size=matrix.shape[0])
    steps = []
    x = RoughSolver(steps.append).prepare(matrix)(b)
    assert 0 < len(steps) < 30
    assert 1e-6 < np.linalg.norm(matrix @ x - b) / np.linalg.norm(b) <= 1e-2


def test_stiff_springs_between_what_is_far_apart_are_factorised():
    matrix = membrane(200)
    n = matrix.shape[0]
    rng = np.random.default_rng(1)
    ends = rng.choice(n, size=(400, 2), replace=False)
    signs = np.tile([1.0, -1.0], len(ends))
    springs = sp.csr_array((signs, (np.repeat(np.arange(len(ends)), 2), ends.ravel())), shape=(len(ends), n))
    stiff = (matrix + springs.T @ (1e8 * springs)).tocsr()
    b = rng.normal(size=n)
    solver = RoughSolver(silent)
    for _ in (1, 2):
        x = solver.prepare(stiff)(b)
        assert np.linalg.norm(stiff @ x - b) / np.linalg.norm(b) < 1e-2


def test_singular_matrices_are_refused():
    with pytest.raises(SolverError, match="2 unknowns"):
        RoughSolver(silent).prepare(sp.csr_array(np.array([[1.0, -1.0], [-1.0, 1.0]])))
