import numpy as np
import pytest

from o3d_relief import ParameterError
from o3d_relief.rays import UnitBox
from o3d_relief.stages.visibility import visible_vertices
from shapes import grid, hills, joined, moved, sphere


def test_sphere_shows_its_front_half():
    vertices, faces = sphere(60)
    visible = visible_vertices(vertices, faces)
    away_from_rim = np.abs(vertices[:, 2]) > 2.0
    assert np.array_equal(visible[away_from_rim], (vertices[:, 2] > 0)[away_from_rim])


def test_near_viewpoint_sees_less_of_a_sphere():
    vertices, faces = sphere(60)
    visible = visible_vertices(vertices, faces, viewpoint=(0, 0, 100))
    horizon = 50.0 * 50.0 / 100.0
    clear = np.abs(vertices[:, 2] - horizon) > 2.0
    assert np.array_equal(visible[clear], (vertices[:, 2] > horizon)[clear])


def test_plate_hides_what_is_behind_it():
    plate = moved(grid(11, size=40), (0, 0, 30))
    wall = grid(41)
    visible = visible_vertices(*joined(wall, plate))
    inside = (np.abs(wall[0][:, :2]) < 19).all(axis=1)
    outside = (np.abs(wall[0][:, :2]) > 21).any(axis=1)
    assert not visible[: len(wall[0])][inside].any()
    assert visible[: len(wall[0])][outside].all()
    assert visible[len(wall[0]) :].all()


def test_open_height_field_is_seen_everywhere():
    assert visible_vertices(*hills()).all()


def test_does_not_depend_on_which_way_faces_turn():
    vertices, faces = sphere(30)
    assert np.array_equal(visible_vertices(vertices, faces), visible_vertices(vertices, faces[:, ::-1]))


def test_viewpoint_inside_the_scene_is_refused():
    with pytest.raises(ParameterError, match="in front of the scene"):
        visible_vertices(*sphere(), viewpoint=(0, 0, 10))


@pytest.mark.parametrize("viewpoint", [None, (3.0, 5.0, 400.0)])
def test_a_box_at_hand_changes_nothing(viewpoint):
    # Two sheets closer to each other than rays begin from their vertices.
    plate = moved((np.array([[-9.0, -9, 0], [9, -9, 0], [0, 9, 0]]), np.array([[0, 1, 2]])), (0.0, 0.0, 30.0))
    vertices, faces = joined(hills(21), plate, moved(hills(21), (0.01, 0.02, 5e-3)), sphere(12))
    expected = visible_vertices(vertices, faces, viewpoint=viewpoint)
    assert expected.any()
    assert not expected.all()
    found = visible_vertices(vertices, faces, viewpoint=viewpoint, box=UnitBox(vertices, faces))
    assert np.array_equal(found, expected)
