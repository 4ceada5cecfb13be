import numpy as np
import pytest
from scipy.spatial.distance import pdist

import oracle
from o3d_relief import cotangent_laplacian
from o3d_relief.stages.order_errors import (
    cluster_radii,
    depth_order_error,
    lift_loose,
    lifting_discs,
    order_errors,
)
from shapes import grid


def _one_part(n):
    return np.zeros(n, dtype=np.int32)


def _sunk():
    """A flat floor 1 unit above S with a smooth hollow that reaches 2 units behind it."""
    vertices, faces = grid(41)
    laplacian, _ = cotangent_laplacian(vertices, faces)
    z = 1.0 - 3.0 * np.exp(-(vertices[:, 0] ** 2 + vertices[:, 1] ** 2) / 200.0)
    return vertices, laplacian, z


def test_radii_agree_with_all_distances():
    rng = np.random.default_rng(0)
    xy = rng.normal(size=(3000, 2)) * [3, 1]
    labels = rng.integers(0, 4, 3000)
    radii = cluster_radii(xy, labels, 5)
    exact = [pdist(xy[labels == c]).max() / 2 for c in range(4)]
    assert radii[:4] == pytest.approx(exact, rel=2e-3)
    assert radii[4] == 0.0


def test_swapped_ends_by_hand():
    assert depth_order_error(np.array([1.0, 2, 3]), np.array([3.0, 2, 1])) == pytest.approx([2 / 3, 0, 2 / 3])


def test_flat_floor_has_no_order_to_lose():
    floor = np.full(50, 2.0)
    assert not depth_order_error(floor, np.random.default_rng(0).normal(size=50)).any()


def test_order_that_is_kept_is_no_error():
    z = np.random.default_rng(0).normal(size=50)
    assert not depth_order_error(z, 3 * z - 7).any()


def test_errors_agree_with_the_literal_equation():
    rng = np.random.default_rng(3)
    vertices, z = rng.uniform(0, 10, (120, 3)), rng.uniform(0, 10, 120)
    index, radii = np.array([4, 50]), np.array([3.0, 6.0])
    found = order_errors(vertices, z, index, radii)
    assert found == pytest.approx(oracle.order_errors(vertices, z, index, radii), abs=1e-12)


def test_everything_visible_behind_is_marked_with_its_surroundings():
    vertices, _, z = _sunk()
    visible = vertices[:, 0] > 0
    marked = lifting_discs(vertices, z, _one_part(len(z)), visible)
    behind = visible & (z < 0)
    assert marked[behind].all()
    distance = np.linalg.norm(vertices[:, None] - vertices[behind], axis=2)
    assert marked[(distance <= 3 * -z[behind]).any(axis=1)].all()
    assert not marked[(distance > 6 * -z[behind]).all(axis=1)].any()
    far = np.where(vertices[:, 0] > 5, 1, 0).astype(np.int32)
    other = far == 1
    assert not lifting_discs(vertices, np.where(other, 1.0, z), far, np.ones(len(z), bool))[other].any()
    assert not lifting_discs(vertices, np.abs(z), _one_part(len(z)), visible).any()


def test_loose_component_is_lifted_as_a_whole():
    label = np.array([0, 0, 0, 1, 1, 1, 2, 2])
    z = np.array([-5.0, 1, 2, -3, -7, 4, -1, 0])
    visible = np.array([True, True, True, True, False, True, False, True])
    found = lift_loose(z, label, np.array([1]), visible)
    assert found.tolist() == [-5, 1, 2, 0, -4, 7, -1, 0]
