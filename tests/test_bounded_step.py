import numpy as np
import pytest

import o3d_relief as rel
from shapes import bust, grid, hills, joined, moved, sphere, to_mesh, turn

STAGES = ["scene", "perspective", "visibility", "bounded", "trim"]
DEPTH = 20.0


@pytest.fixture(scope="module")
def mesh():
    return to_mesh(bust())


@pytest.fixture(scope="module")
def relief(mesh):
    return rel.make_relief(mesh, rel.ReliefParams(depth=DEPTH))


def heights(relief):
    return np.asarray(relief.mesh.vertices)[:, 2]


def test_stages_of_the_bounded_mode(relief):
    assert list(relief.stages) == STAGES
    assert relief.summary()["mode"] == "bounded"
    assert relief.stages["bounded"].counts["left"] == 0


def test_depth_is_exact_and_the_certificate_clean(relief):
    assert heights(relief).max() == pytest.approx(DEPTH, rel=1e-12)
    assert heights(relief).min() == 0.0
    assert relief.certificate.failures == []
    assert relief.certificate.grid_pairs_tested > 1000


def test_x_and_y_stay_where_they_are(relief, mesh):
    kept = relief.source_index >= 0
    inside = np.asarray(mesh.vertices)[relief.source_index[kept]]
    back = np.c_[np.asarray(relief.mesh.vertices)[kept], np.ones(kept.sum())] @ relief.to_scene.T
    assert back[:, :2] == pytest.approx(inside[:, :2], abs=1e-9)


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_moved_turned_and_scaled_scene_gives_the_same_relief(relief, scale):
    vertices, faces = bust()
    rotation = turn(5)
    there = scale * (vertices @ rotation.T + [30, -70, 11])
    view = rel.View(front=rotation[:, 2], up=rotation[:, 1])
    again = rel.make_relief(to_mesh((there, faces)), rel.ReliefParams(depth=DEPTH * scale), view=view)
    assert np.array_equal(again.source_index, relief.source_index)
    assert np.abs(heights(again) / scale - heights(relief)).max() <= 1e-4


def test_same_input_same_bytes(relief, mesh):
    again = rel.make_relief(mesh, rel.ReliefParams(depth=DEPTH))
    assert np.asarray(again.mesh.vertices).tobytes() == np.asarray(relief.mesh.vertices).tobytes()


def test_scene_that_is_shallow_already_is_left_alone(mesh):
    again = rel.make_relief(mesh, rel.ReliefParams(depth=1000))
    assert again.stages["bounded"].counts["already_shallower"] == 1
    z = again.stages["bounded"].z
    assert z == pytest.approx(again.stages["scene"].vertices[:, 2] + z.min())


def test_very_little_depth_is_met(mesh):
    unit = rel.make_relief(mesh, rel.ReliefParams(depth=1000)).stages["scene"].unit
    relief = rel.make_relief(mesh, rel.ReliefParams(depth=1.001e-3 * unit))
    assert heights(relief).max() == pytest.approx(1.001e-3 * unit)
    assert relief.certificate.visible_behind == 0
    with pytest.raises(rel.ParameterError, match="depth must be at least"):
        rel.make_relief(mesh, rel.ReliefParams(depth=0.999e-3 * unit))


def test_loose_parts_keep_contact_and_order():
    floor = moved(grid(21), (0, 0, 0))
    ball = moved(sphere(16, 12.0), (10, 5, 12))
    pebble = moved(sphere(8, 4.0), (-25, 10, 30))
    scene = to_mesh(joined(floor, ball, pebble))
    relief = rel.make_relief(scene, rel.ReliefParams(depth=6.0))
    assert relief.certificate.failures == []
    assert heights(relief).max() == pytest.approx(6.0)


def test_attached_vertices_and_weights(mesh):
    shape = hills()
    n = len(shape[0])
    params = rel.ReliefParams(depth=10, attach=[840, 1200], weights=np.linspace(1, 2, n))
    relief = rel.make_relief(to_mesh(shape), params)
    assert (relief.stages["bounded"].z[relief.stages["bounded"].attached] == 0.0).all()
    assert relief.stages["bounded"].counts["attached"] == 2
    assert "weights" not in relief.summary()["params"]


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"attach": [10**6]}, "attach must be numbers of the mesh's"),
        ({"weights": [1.0, 2.0]}, "weights must be one number for each of the mesh's"),
    ],
)
def test_parameters_that_do_not_fit_the_scene(mesh, values, words):
    with pytest.raises(rel.ParameterError, match=words):
        rel.make_relief(mesh, rel.ReliefParams(depth=5, **values))


def test_smallest_gap_is_kept_where_there_is_room():
    scene = to_mesh(joined(grid(11), moved(grid(5, size=30.0), (0, 0, 30))))
    relief = rel.make_relief(scene, rel.ReliefParams(depth=10.0, min_gap=3.0))
    assert relief.stages["bounded"].counts["left"] == 0
    assert relief.certificate.failures == []
