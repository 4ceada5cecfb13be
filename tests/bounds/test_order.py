import numpy as np
import pytest

from o3d_relief import cotangent_laplacian
from o3d_relief.bounds.gaps import out_of_order
from o3d_relief.bounds.grid import grid_pairs
from o3d_relief.bounds.lines import Lines
from o3d_relief.bounds.order import keep_order
from o3d_relief.bounds.pairs import Pairs, vertex_pairs
from o3d_relief.linalg.laplacian import vertex_areas
from shapes import grid, joined, moved


def _setup(shape, side=64):
    vertices, faces = shape
    laplacian, _ = cotangent_laplacian(vertices, faces)
    pairs = Pairs.join([vertex_pairs(Lines(vertices, faces)), grid_pairs(Lines(vertices, faces), side=side)])
    return vertices, faces, laplacian, vertex_areas(vertices, faces), pairs


def _comb():
    """A comb in front of a comb in front of a wall."""
    bars = [moved(_bar(), (x, 0, z)) for z, shift in ((20, 0), (10, 8)) for x in range(-40 + shift, 41, 16)]
    return joined(grid(31), *bars)


def _bar():
    vertices, faces = grid(21, size=90)
    return vertices * [0.12, 1, 1], faces


def test_what_is_in_order_is_left_alone():
    vertices, faces, laplacian, areas, pairs = _setup(_comb())
    found = keep_order(vertices, faces, laplacian, areas, vertices[:, 2] * 0.5, pairs)
    assert found.rounds == 0
    assert np.array_equal(found.z, vertices[:, 2] * 0.5)


@pytest.mark.parametrize("min_gap", [0.0, 2.0])
def test_swapped_layers_come_back_into_order(min_gap):
    vertices, faces, laplacian, areas, pairs = _setup(_comb())
    z = np.where(vertices[:, 2] > 15, 3.0, vertices[:, 2])  # the front comb sinks behind the other one
    assert out_of_order(pairs, z).sum() > 100
    found = keep_order(vertices, faces, laplacian, areas, z, pairs, min_gap=min_gap)
    assert found.left == 0
    upper, lower = pairs.heights(found.z)
    assert (upper - lower >= np.minimum(min_gap, pairs.gap) - 1e-4).all()


def test_correction_is_local():
    shape = joined(grid(41), moved(grid(9, size=10), (-40, 0, 5)), moved(grid(9, size=10), (40, 0, 5)))
    vertices, faces, laplacian, areas, pairs = _setup(shape)
    z = vertices[:, 2].copy()
    z[1681 : 1681 + 81] = -1.0 + 2.0
    z[:1681] = 1.5  # the wall stands before the first plate now, and behind the second
    z[1681 + 81 :] = 6.5
    found = keep_order(vertices, faces, laplacian, areas, z, pairs)
    assert found.left == 0
    far = vertices[:, 0] > 10
    assert np.array_equal(found.z[far], z[far])


def test_visible_vertices_come_in_front():
    vertices, faces, laplacian, areas, pairs = _setup(_comb())
    z = vertices[:, 2] - 4.0 * np.exp(-(vertices[:, 0] ** 2) / 200)
    everything = np.ones(len(z), dtype=bool)
    found = keep_order(vertices, faces, laplacian, areas, z, pairs, in_front=everything)
    assert found.left == 0
    assert (found.z >= 0).all()


def test_corrections_stay_small():
    vertices, faces, laplacian, areas, pairs = _setup(_comb())
    z = vertices[:, 2].copy()
    z[vertices[:, 2] > 15] -= 11.0  # one unit too deep
    found = keep_order(vertices, faces, laplacian, areas, z, pairs)
    assert found.left == 0
    assert np.abs(found.z - z).max() < 2.5
