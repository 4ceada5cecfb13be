import numpy as np
import pytest

import o3d_relief as rel
from o3d_relief.plate_params import PlateParams
from o3d_relief.solid.estimate import estimate_relief, estimate_solid, front_size, relief_depth
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
    assert found.size == pytest.approx(tuple(solid.size), abs=0.5)
    assert found.volume_mm3 == pytest.approx(solid.volume, rel=0.4)
    assert 0.95 < solid.counts["depth_ratio"] < 1.05  # the relief itself is as deep as it has to be
    assert found.memory_mb > 500
    assert front_size(scene, view, plate) == found.size[:2]


def test_without_a_depth_it_is_at_most_that_of_the_scene(scene):
    found = estimate_solid(scene, rel.ReliefParams(), rel.View(), PlateParams(shape="none"))
    width, _, depth = np.ptp(np.asarray(scene.vertices), axis=0)
    assert not found.depth_known
    assert found.size[2] == pytest.approx(depth / width * 150.0, rel=1e-6)
    assert relief_depth(scene, rel.View(), PlateParams()) is None
    given = estimate_solid(scene, rel.ReliefParams(depth=width / 10), rel.View(), PlateParams(shape="none"))
    assert given.depth_known
    assert given.size[2] == pytest.approx(15.0)
    share = estimate_solid(scene, rel.ReliefParams(depth="20%"), rel.View(), PlateParams(shape="none"))
    made = rel.make_relief(scene, rel.ReliefParams(depth="20%"))
    assert share.visible_depth == pytest.approx(made.summary()["scene_visible_depth"])
    assert share.size[2] == pytest.approx(made.summary()["relief_depth"] / width * 150.0)


@pytest.mark.parametrize("depth", ["20%", 12.5])
def test_a_relief_alone_measures_what_was_said(scene, depth):
    params, view = rel.ReliefParams(depth=depth), rel.View()
    found = estimate_relief(scene, params, view)
    relief = rel.make_relief(scene, params, view=view)
    assert found.depth_known
    assert found.size == pytest.approx(tuple(np.ptp(np.asarray(relief.mesh.vertices), axis=0)), rel=1e-6)
    assert found.visible_depth == pytest.approx(relief.summary()["scene_visible_depth"])
    assert found.volume_mm3 is None


def test_a_relief_alone_is_at_most_as_deep_as_its_scene(scene):
    most = np.ptp(np.asarray(scene.vertices), axis=0)
    for params in (rel.ReliefParams(k=32), rel.ReliefParams(depth=2.0 * most[2])):
        found = estimate_relief(scene, params, rel.View())
        made = np.ptp(np.asarray(rel.make_relief(scene, params).mesh.vertices), axis=0)
        assert not found.depth_known
        assert found.size == pytest.approx(tuple(most))
        assert (made <= most * (1.0 + 1e-9)).all()
