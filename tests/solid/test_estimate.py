import numpy as np
import pytest

import o3d_relief as rel
from o3d_relief.plate_params import PlateParams
from o3d_relief.solid.estimate import estimate_solid, relief_depth
from shapes import bust, moved, to_mesh


@pytest.fixture(scope="module")
def scene():
    return to_mesh(moved(bust(40), (5.0, -3.0, 1000.0)))


@pytest.mark.parametrize("shape", ["rectangle", "ellipse", "none"])
def test_the_solid_measures_what_was_said(scene, shape):
    plate = PlateParams(width_mm=90, depth_mm=15, shape=shape)
    params, view = rel.ReliefParams(k=32, depth=relief_depth(scene, rel.View(), plate)), rel.View()
    found = estimate_solid(scene, params, view, plate)
    solid = rel.make_solid(rel.make_relief(scene, params, view=view), plate)
    assert found.depth_known
    assert solid.size[[0, 2]] == pytest.approx([90, 15], abs=1e-9)
    assert found.size_mm == pytest.approx(tuple(solid.size), abs=0.5)
    assert found.volume_mm3 == pytest.approx(solid.volume, rel=0.4)
    assert 0.95 < solid.counts["depth_ratio"] < 1.05  # the relief itself is as deep as it has to be
    assert found.memory_mb > 500


def test_without_a_depth_it_is_at_most_that_of_the_scene(scene):
    found = estimate_solid(scene, rel.ReliefParams(), rel.View(), PlateParams(shape="none"))
    width, _, depth = np.ptp(np.asarray(scene.vertices), axis=0)
    assert not found.depth_known
    assert found.size_mm[2] == pytest.approx(depth / width * 150.0, rel=1e-6)
    assert relief_depth(scene, rel.View(), PlateParams()) is None
    given = estimate_solid(scene, rel.ReliefParams(depth=width / 10), rel.View(), PlateParams(shape="none"))
    assert given.depth_known
    assert given.size_mm[2] == pytest.approx(15.0)
    share = estimate_solid(scene, rel.ReliefParams(depth="20%"), rel.View(), PlateParams(shape="none"))
    made = rel.make_relief(scene, rel.ReliefParams(depth="20%"))
    assert share.visible_depth == pytest.approx(made.summary()["scene_visible_depth"])
    assert share.size_mm[2] == pytest.approx(made.summary()["relief_depth"] / width * 150.0)
