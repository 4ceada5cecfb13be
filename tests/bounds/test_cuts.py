import numpy as np
import pytest

from o3d_relief import cotangent_laplacian
from o3d_relief.bounds.between import Between
from o3d_relief.bounds.crossings import edges_of
from o3d_relief.bounds.cuts import cut_crossings
from o3d_relief.bounds.new_crossings import new_crossings
from o3d_relief.bounds.order import keep_order
from o3d_relief.bounds.pairs import Pairs, foot_pairs
from o3d_relief.bounds.raster import Raster
from o3d_relief.linalg.laplacian import vertex_areas
from o3d_relief.stages.trim import trim_behind


def _hanging(shift=0.0):
    """A plate, and an upright triangle that hangs from it and reaches down beyond its border."""
    plate = [[-10.0, -10, 10], [10, -10, 10], [10, 0, 10], [-10, 0, 10]]
    blade = [[0.0, -2, 10], [0, 0, 10], [shift, 8, 2]]
    return np.array(plate + blade), np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6]])


RISEN = np.array([2.0, 2, 2, 2, 2, 2.5, -18])
"""The middle corner of the blade has come up through the border of the plate."""


def test_a_blade_that_comes_up_through_the_border_of_its_plate_goes_back():
    vertices, faces = _hanging()
    edges = edges_of(faces)
    assert new_crossings(vertices, faces, edges, RISEN)[1] == 0  # the blade is a line: nothing tells
    assert len(foot_pairs(vertices, faces, edges, RISEN)) == 0
    laplacian, _ = cotangent_laplacian(vertices, faces)
    areas = vertex_areas(vertices, faces)
    found = keep_order(vertices, faces, laplacian, areas, RISEN, Pairs.join([]))
    assert found.left == 0
    assert found.z[5] <= found.z[2:4].mean() + 1e-3


def test_the_diagonal_is_the_one_that_the_trim_makes():
    vertices, faces = _hanging()
    pairs, count = cut_crossings(vertices, faces, Raster(vertices, faces), RISEN)
    assert count == 1
    moved = np.column_stack([vertices[:, :2], RISEN])
    trimmed = trim_behind(moved, faces[2:], np.ones(len(vertices), dtype=bool))
    made = np.sort(trimmed.vertices[edges_of(trimmed.faces)][:, :, 1], axis=1)
    assert [-1.0, 0.0] in made.tolist()  # from the middle corner to where S cuts the longest side
    places = [
        np.einsum("pc,pc->p", vertices[:, 1][corners], weights)
        for corners, weights in ((pairs.upper, pairs.upper_weights), (pairs.lower, pairs.lower_weights))
    ]
    assert places[0] == pytest.approx(places[1])
    assert sorted(places[0]) == pytest.approx([-1.0, 0.0])
    assert pairs.gap == pytest.approx([0.0, 0.8])


def test_what_shows_as_a_surface_is_left_to_its_edges():
    vertices, faces = _hanging(shift=1.0)
    assert cut_crossings(vertices, faces, Raster(vertices, faces), RISEN)[1] == 0


def test_only_diagonals_of_the_triangles_asked_for_are_looked_at():
    vertices, faces = _hanging()
    for blade, count in ((False, 0), (True, 1)):
        among = np.array([not blade, not blade, blade])
        assert cut_crossings(vertices, faces, Raster(vertices, faces), RISEN, among=among)[1] == count


def test_a_blade_is_told_of_until_it_has_gone_back():
    vertices, faces = _hanging()
    none = Pairs.join([])
    between = Between(vertices, faces, cotangent_laplacian(vertices, faces)[0])
    before = vertices[:, 2] + 1.0
    for z, count in ((before, 0), (RISEN, 1), (RISEN, 1), (before, 0), (before, 0), (RISEN, 1)):
        between.look_at(z)
        assert between.look_closer(z, none)[1] == count
