import numpy as np
import pytest

from o3d_relief.linalg.laplacian import cotangent_laplacian
from o3d_relief.linalg.patches import Patches
from shapes import grid, hills, joined, moved


def patches(shape, most):
    vertices, faces = shape
    form, _ = cotangent_laplacian(vertices, faces)
    return Patches(form, vertices, most)


def left(maps, values):
    """What of values is outside of the space."""
    return np.abs(values - maps @ (maps.T @ values)).max()


def test_few_patches_hold_every_linear_function_of_the_positions():
    shape = hills(40)
    found = patches(shape, 30)
    maps = found.maps()
    assert 1 < found.number.max() + 1 <= 30
    assert maps.shape[1] <= 4 * 30
    assert (maps.T @ maps).toarray() == pytest.approx(np.eye(maps.shape[1]), abs=1e-9)
    for values in (np.ones(1600), *shape[0].T):
        assert left(maps, values) < 1e-9


def test_parts_share_no_patch_and_single_vertices_have_their_own():
    shape = joined(grid(12), moved(grid(12), (0.0, 0.0, 30.0)))
    vertices, faces = shape
    vertices = np.concatenate([vertices, [[500.0, 0.0, 0.0]]])  # of no face
    found = patches((vertices, faces), 1)
    assert not set(found.number[:144]) & set(found.number[144:288])
    assert (found.number == found.number[-1]).sum() == 1
    assert left(found.maps(), (np.arange(289) == 288).astype(float)) < 1e-12


def test_splitting_goes_down_to_single_vertices_where_something_is_missing():
    found = patches(hills(40), 30)
    before = found.maps()
    missing = np.zeros(1600)
    missing[[820, 17]] = 1.0, 1e-3
    for _ in range(4):
        found.split(missing, 1e-2)
    after, number = found.maps(), found.number
    assert left(after, missing * (np.arange(1600) == 820)) < 1e-12
    assert left(after, missing * (np.arange(1600) == 17)) > 1e-4
    assert (number == number[17]).sum() > 5
    assert before.shape[1] < after.shape[1] < 400
    for column in before.T.toarray():  # nothing is lost
        assert left(after, column) < 1e-9


def test_all_that_is_missing_can_be_split():
    found = patches(hills(20), 10)
    for _ in range(5):
        found.split(np.ones(400), 0.0)
    assert found.maps().shape == (400, 400)
