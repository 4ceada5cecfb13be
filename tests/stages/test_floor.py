import numpy as np
import pytest

from o3d_relief.stages.floor import lowest_heights
from shapes import grid, hills, moved


def test_plane_has_its_floor_on_the_plane():
    vertices, _ = grid(41)
    floor = lowest_heights(
        moved((vertices, None), (0, 0, 7.0))[0], np.ones(len(vertices), dtype=bool), share=0.5
    )
    assert floor == pytest.approx(0.0, abs=1e-12)


def test_floor_keeps_a_share_of_the_local_relief():
    vertices, _ = hills(201)
    everything = np.ones(len(vertices), dtype=bool)
    floor = lowest_heights(vertices, everything, share=0.5)
    assert (floor >= 0.0).all()
    assert (floor <= 0.5 * (vertices[:, 2] - vertices[:, 2].min()) + 1e-12).all()
    assert floor.max() > 0.1
    assert lowest_heights(vertices, everything, share=0.25) == pytest.approx(floor / 2)
    assert lowest_heights(
        moved((vertices, None), (3.0, -2.0, 50.0))[0], everything, share=0.5
    ) == pytest.approx(floor)


def test_slope_stays_a_slope():
    vertices, _ = grid(201)
    vertices = vertices * [1, 1, 0] + vertices[:, :1] * [0, 0, 2.0]  # rises by 2 for each unit of x
    floor = lowest_heights(vertices, np.ones(len(vertices), dtype=bool), share=0.1)
    inside = np.abs(vertices[:, :2]).max(axis=1) < 45
    # The lowest point around lies one and a half units down the slope, give or take a cell.
    assert floor[inside].min() > 0.1 * 2.0 * 0.5
    assert floor[inside].max() < 0.1 * 2.0 * 2.0


def test_hidden_vertices_have_no_floor():
    vertices, _ = hills(201)
    visible = vertices[:, 0] > 0
    floor = lowest_heights(vertices, visible, share=0.5)
    assert np.array_equal(floor == -np.inf, ~visible)


def test_outlines_do_not_count_what_lies_far_behind_as_their_surroundings():
    wall, bar = grid(201)[0], moved((grid(41, size=20)[0], None), (0, 0, 60.0))[0]
    vertices = np.concatenate([wall, bar])
    visible = np.abs(vertices[:, :2]).max(axis=1) > 10.0
    visible[len(wall) :] = True
    floor = lowest_heights(vertices, visible, share=0.2)
    on_bar = floor[len(wall) :]
    inside = np.abs(bar[:, :2]).max(axis=1) < 8.0
    assert on_bar[inside] == pytest.approx(0.0, abs=1e-12)
    assert 0.0 < on_bar.max() <= 0.2 * 2.0
