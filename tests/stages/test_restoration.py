import numpy as np
import pytest

import oracle
from o3d_relief import cotangent_laplacian
from o3d_relief.stages.construction import construct
from o3d_relief.stages.order_errors import (
    lifting_discs,
    smoothing_discs,
)
from o3d_relief.stages.restoration import restore
from shapes import grid, hills, joined, moved

INDEX = np.array([60, 220])


def _one_part(n):
    return np.zeros(n, dtype=np.int32)


def _bent(side=17):
    vertices, faces = hills(side)
    laplacian, _ = cotangent_laplacian(vertices, faces)
    z = construct(vertices, laplacian, INDEX, np.array([30.0, -30.0])).z
    high = smoothing_discs(vertices, INDEX, np.array([60.0, 60.0]))
    return (vertices, faces), laplacian, z, high


@pytest.mark.parametrize("blend", [0.0, 0.5, 0.9, 1.0])
def test_agrees_with_the_literal_appendix(blend):
    shape, laplacian, z, high = _bent()
    found = restore(shape[0], laplacian, z, high, INDEX, _one_part(len(z)), blend=blend)
    assert np.array_equal(found.solved, high)
    assert found.z == pytest.approx(oracle.restore(shape, z, high, blend), abs=1e-6)


def test_only_high_vertices_move():
    shape, laplacian, z, high = _bent()
    found = restore(shape[0], laplacian, z, high, INDEX, _one_part(len(z)))
    assert np.array_equal(found.z[~high], z[~high])
    assert (found.z[INDEX] != z[INDEX]).all()


def test_spike_is_removed():
    shape, laplacian, z, high = _bent()
    found = restore(shape[0], laplacian, z, high, INDEX, _one_part(len(z)))
    assert (
        np.abs(laplacian @ (found.z - shape[0][:, 2])).max()
        < 0.3 * np.abs(laplacian @ (z - shape[0][:, 2])).max()
    )


def _sunk():
    """A flat floor 1 unit above S with a smooth hollow that reaches 2 units behind it."""
    vertices, faces = grid(41)
    laplacian, _ = cotangent_laplacian(vertices, faces)
    z = 1.0 - 3.0 * np.exp(-(vertices[:, 0] ** 2 + vertices[:, 1] ** 2) / 200.0)
    return vertices, laplacian, z


def test_nothing_visible_ends_behind_the_plane():
    vertices, laplacian, z = _sunk()
    high = lifting_discs(vertices, z, _one_part(len(z)), np.ones(len(z), dtype=bool))
    plane = np.zeros(len(z))
    found = restore(vertices, laplacian, z, high, np.array([0]), _one_part(len(z)), floor=plane)
    assert (found.z >= 0).all()
    assert np.array_equal(found.z[~high], z[~high])


def test_nothing_ends_below_its_floor():
    vertices, laplacian, z = _sunk()
    floor = np.where(vertices[:, 0] < 0, -np.inf, 0.01 * vertices[:, 0])
    high = np.linalg.norm(vertices[:, :2], axis=1) < 40
    found = restore(vertices, laplacian, z - 0.9, high, np.array([0]), _one_part(len(z)), floor=floor)
    assert (found.z >= np.where(high, floor, -np.inf)).all()
    assert found.set_on_floor == (found.z == floor).sum() > 10
    free = vertices[:, 0] < 0
    assert (found.z[free] < -0.01 * vertices[free, 0]).any()  # the mirrored floor


def test_plane_holds_the_surface_off_and_never_pulls_it():
    vertices, laplacian, z = _sunk()
    high = np.linalg.norm(vertices[:, :2], axis=1) < 40
    found = restore(
        vertices,
        laplacian,
        z - 0.9,
        high,
        np.array([0]),
        _one_part(len(z)),
        floor=np.zeros(len(z)),
        blend=1.0,
    )
    force = (laplacian @ (found.z - vertices[:, 2]))[high]
    on_plane = found.z[high] == 0
    assert (force[on_plane] > -1e-9).all()
    assert np.abs(force[~on_plane]).max() < 1e-8


def test_no_high_vertices_change_nothing():
    shape, laplacian, z, high = _bent()
    found = restore(shape[0], laplacian, z, np.zeros_like(high), INDEX, _one_part(len(z)))
    assert np.array_equal(found.z, z)


def test_wholly_high_component_is_held_by_its_points():
    part = hills(5)
    shape = joined(part, moved(part, (300, 0, 0)))
    laplacian, _ = cotangent_laplacian(*shape)
    index = np.array([12])
    z = construct(shape[0], laplacian, index, np.array([1.0])).z
    high = np.ones(50, dtype=bool)
    label = np.repeat([0, 1], 25).astype(np.int32)
    found = restore(shape[0], laplacian, z, high, index, label)
    assert found.points_held == 1
    assert found.z[12] == 1.0
    assert np.array_equal(found.z[25:], z[25:])
    assert not found.solved[25:].any()
