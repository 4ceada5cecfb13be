"""The pictures of the stages that leave the scene as it is."""

import dataclasses

import numpy as np
import pytest

from o3d_relief.records import AttenuationStage
from o3d_relief.show import scene_panels
from o3d_relief.show.render import render
from o3d_relief.show.sheets import stage_picture
from stage_records import make_stages

SIZE = (168, 80)


@pytest.fixture(scope="module")
def stages():
    return make_stages()


def test_visible_and_hidden_have_two_colors(stages):
    image = stage_picture("visibility", stages, size=(408, 200)).astype(int)
    warm = image[..., 0] > 1.3 * image[..., 2]
    cold = image[..., 2] > 1.3 * image[..., 0]
    front, side = slice(0, 200), slice(208, 408)
    surface = slice(20, 170)  # without the legend
    assert warm[surface, front].sum() > 20 * max(cold[surface, front].sum(), 1)
    assert warm[surface, side].sum() > 1000
    assert cold[surface, side].sum() > 1000


def test_no_attenuation_point_is_drawn_without_one(stages):
    empty = np.zeros(0)
    none = AttenuationStage(
        index=np.zeros(0, dtype=np.int64),
        cluster=np.zeros(0, dtype=np.int64),
        height=empty.copy(),
        differential=empty.copy(),
        rho=empty.copy(),
        beta=empty.copy(),
        action=np.zeros(0, dtype=np.str_),
        new_height=empty.copy(),
    )
    with_points = stage_picture("attenuation", stages, size=SIZE)
    without = stage_picture("attenuation", {**stages, "attenuation": none}, size=SIZE)
    assert without.shape == with_points.shape
    assert not np.array_equal(without, with_points)


def test_no_scale_where_all_points_lie_on_the_plane(stages, monkeypatch):
    drawn = []
    monkeypatch.setattr(scene_panels, "render", lambda *a, **o: drawn.append(o) or render(*a, **o))
    flat = dataclasses.replace(stages["attenuation"], new_height=np.zeros(4))
    for record, scale in ((stages["attenuation"], True), (flat, False)):
        stage_picture("attenuation", {**stages, "attenuation": record}, size=SIZE)
        assert (drawn[-1]["point_field"] is not None) == scale
        assert ("new heights: all 0, " in drawn[-1]["title"]) != scale
