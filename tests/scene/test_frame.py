import numpy as np
import pytest

from o3d_relief import MeshError
from o3d_relief.scene.frame import RELIEF_UNITS, relief_frame, to_relief_units
from shapes import bust, grid, turn


def test_axes_point_right_up_and_to_the_viewer():
    vertices = np.array([[0, 0, 0], [10, 0, 0], [0, 20, 0], [0, 0, 5.0]])
    frame = relief_frame(vertices, front=(0, -1, 0), up=(0, 0, 1))
    assert frame.rotation.round(12).tolist() == [[1, 0, 0], [0, 0, 1], [0, -1, 0]]


def test_scene_is_100_units_wide_behind_nothing_and_centred():
    vertices, _ = bust()
    moved = to_relief_units(vertices, relief_frame(vertices))
    low, high = moved.min(axis=0), moved.max(axis=0)
    assert (high - low)[:2].max() == pytest.approx(RELIEF_UNITS)
    assert low[2] == pytest.approx(0.0, abs=1e-12)
    assert (low + high)[:2] == pytest.approx(0.0, abs=1e-9)


def test_up_need_not_be_across_front():
    vertices, _ = bust()
    frame = relief_frame(vertices, front=(0, 0, 1), up=(0, 1, 0.8))
    assert frame.rotation == pytest.approx(np.eye(3), abs=1e-12)


def test_way_back_to_the_scene():
    vertices, _ = bust()
    frame = relief_frame(vertices, front=(1, 2, 3), up=(0, 1, 0))
    here = to_relief_units(vertices, frame) * frame.unit
    back = here @ frame.to_scene[:3, :3].T + frame.to_scene[:3, 3]
    assert back == pytest.approx(vertices, abs=1e-9)
    assert np.linalg.det(frame.to_scene) == pytest.approx(1.0)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_grid_removes_what_moving_turning_and_scaling_leaves(scale):
    vertices, _ = bust()
    here = to_relief_units(vertices, relief_frame(vertices), on_grid=True)
    rotation = turn(3)
    there = scale * vertices @ rotation.T + scale * np.array([120.0, -310, 77])
    frame = relief_frame(there, tuple(rotation[:, 2]), tuple(rotation[:, 1]))
    again = to_relief_units(there, frame, on_grid=True)
    assert np.array_equal(here, again)


def test_edge_on_scene_is_refused():
    flat = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.0]])
    with pytest.raises(MeshError, match="edge-on"):
        relief_frame(flat, front=(1, 0, 0), up=(0, 0, 1))
    with pytest.raises(MeshError, match="edge-on"):
        relief_frame(np.ones((3, 3)))


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("scale", [1e-150, 1.0, 1e140])
def test_edge_on_from_any_side(seed, scale):
    flat, _ = grid(12)
    rotation = turn(seed)
    angle = np.random.default_rng(seed).uniform(0, 7)
    sideways = rotation @ [np.cos(angle), np.sin(angle), 0]
    with pytest.raises(MeshError, match="edge-on"):
        relief_frame(
            scale * flat @ rotation.T, tuple(sideways), tuple(np.cross(sideways, rotation[:, 0] + 0.3))
        )
    assert relief_frame(scale * flat @ rotation.T, tuple(rotation[:, 2]), tuple(rotation[:, 1])).unit > 0


def test_flat_scene_from_the_front_is_fine():
    flat = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.0]])
    assert relief_frame(flat).unit == pytest.approx(0.01)


def test_a_small_piece_far_from_the_origin_is_no_line():
    flat = 1e-3 * np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.0]])
    assert relief_frame(flat + np.array([5e5, 5e6, 100.0])).unit == pytest.approx(1e-5, rel=1e-3)
