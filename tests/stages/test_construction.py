import numpy as np
import pytest
import scipy.sparse.linalg as sla

import oracle
from o3d_relief import cotangent_laplacian
from o3d_relief.stages.construction import construct
from shapes import bust, grid, hills, joined, moved

INDEX = np.array([7, 100, 60])
HEIGHT = np.array([0.0, -3.0, 5.0])


def _construct(shape, index=INDEX, height=HEIGHT):
    laplacian, _ = cotangent_laplacian(*shape)
    return laplacian, construct(shape[0], laplacian, index, height)


@pytest.mark.parametrize("shape", [hills(11), bust(12)])
def test_agrees_with_the_literal_appendix(shape):
    _, built = _construct(shape)
    assert built.z == pytest.approx(oracle.construct(shape, INDEX, HEIGHT), abs=1e-8)


def test_fixed_points_are_hit_exactly_and_differentials_kept():
    shape = hills(91)
    laplacian, built = _construct(shape)
    assert built.z[INDEX].tolist() == HEIGHT.tolist()
    change = laplacian @ (built.z - shape[0][:, 2])
    change[INDEX] = 0.0
    assert np.linalg.norm(change) <= 1e-8 * np.linalg.norm(laplacian @ shape[0][:, 2])


def test_large_meshes_agree_with_a_factorisation_to_a_hundred_millionth_of_the_extent():
    shape = hills(91)
    laplacian, built = _construct(shape)
    free = np.ones(len(shape[0]), dtype=bool)
    free[INDEX] = False
    moved_by = np.zeros(len(free))
    moved_by[INDEX] = HEIGHT - shape[0][INDEX, 2]
    rows = laplacian[np.flatnonzero(free)]
    moved_by[free] = sla.splu(rows[:, np.flatnonzero(free)].tocsc()).solve(-(rows @ moved_by))
    assert built.z == pytest.approx(shape[0][:, 2] + moved_by, abs=1e-6)


def test_points_that_stay_change_nothing():
    shape = hills(21)
    _, built = _construct(shape, INDEX, shape[0][INDEX, 2])
    assert np.array_equal(built.z, shape[0][:, 2])


def test_points_that_move_together_move_the_whole():
    shape = hills(21)
    _, built = _construct(shape, INDEX, shape[0][INDEX, 2] - 4.0)
    assert built.z == pytest.approx(shape[0][:, 2] - 4.0, abs=1e-8)


def test_loose_component_moves_with_its_nearest_neighbour():
    floor = grid(11)
    near, far = moved(grid(3, size=4), (30, 0, 2)), moved(grid(3, size=4), (-30, 0, 50))
    shape = joined(floor, near, far)
    corners = np.array([0, 10, 110, 120])
    _, built = _construct(shape, corners, np.array([0.0, 0, 10, 10]))
    displacement = built.z - shape[0][:, 2]
    assert (built.components, built.loose_components) == (3, 2)
    for start, x in ((121, 30), (130, -30)):
        assert np.ptp(displacement[start : start + 9]) == 0.0
        under = displacement[:121][np.abs(shape[0][:121, 0] - x) < 0.1]
        assert under.min() - 1e-9 <= displacement[start] <= under.max() + 1e-9
