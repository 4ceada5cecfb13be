import numpy as np

from o3d_relief import cotangent_laplacian
from o3d_relief.bounds.between import Between
from o3d_relief.bounds.pairs import Pairs
from shapes import grid, joined, moved


def _plates():
    return joined(grid(9), moved(grid(9), (3.3, 1.7, 10)))


def _looking(vertices, faces):
    return Between(vertices, faces, cotangent_laplacian(vertices, faces)[0])


def test_plates_that_sank_into_each_other_are_found_and_kept_apart():
    vertices, faces = _plates()
    z = vertices[:, 2] + np.where(np.arange(len(vertices)) == len(vertices) - 41, -12.0, 5.0)
    pairs, count = _looking(vertices, faces).look_at(z)
    assert count > 0
    upper, lower = pairs.heights(z)
    assert (upper < lower).any()
    upper, lower = pairs.heights(vertices[:, 2])
    assert (upper > lower).all()


def test_nothing_is_found_in_the_scene_itself_nor_again_where_nothing_moved():
    vertices, faces = _plates()
    between = _looking(vertices, faces)
    assert between.look_at(vertices[:, 2] + 1.0)[1] == 0
    assert between.look_closer(vertices[:, 2] + 1.0, Pairs.join([]))[1] == 0
    sunk = vertices[:, 2] + np.where(np.arange(len(vertices)) == len(vertices) - 41, -12.0, 5.0)
    assert between.look_at(sunk)[1] > 0
    assert between.look_at(sunk)[1] == 0
    between.forget()
    assert between.look_at(sunk)[1] > 0
