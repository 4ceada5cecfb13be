"""The stages of real runs: surfaces, colours, words."""

import numpy as np
import open3d as o3d
import pytest

from o3d_relief.params import ReliefParams
from o3d_relief.pipeline import make_relief
from o3d_relief.show.mesh_colors import vertex_colors
from o3d_relief.show.paint import PLASTER
from o3d_relief.show.scene_panels import ACTIONS, HIDDEN, SEEN
from o3d_relief.show.stage_surfaces import CutRelief
from o3d_relief.show.viewer_album import INPUT_COLORS, Album
from o3d_relief.show.viewer_state import ViewerState
from shapes import bust, exploded, to_mesh


@pytest.fixture(scope="module")
def scene():
    mesh = to_mesh(exploded(bust(24)))  # every face with corners of its own: welding renumbers
    colors = np.repeat(np.random.default_rng(1).random((len(mesh.triangles), 3)), 3, axis=0)
    places, number = np.unique(np.asarray(mesh.vertices), axis=0, return_inverse=True)
    by_place = np.random.default_rng(2).random((len(places), 3))
    assert len(colors) == len(number)
    mesh.vertex_colors = o3d.utility.Vector3dVector(by_place[number.ravel()])
    return mesh


@pytest.fixture(scope="module")
def relief(scene):
    return make_relief(scene, ReliefParams(k=12))


@pytest.fixture(scope="module")
def bounded(scene):
    return make_relief(scene, ReliefParams(depth=20.0))


def album_of(relief, colors=None):
    album = Album(colors)
    for record in relief.stages.values():
        assert album.add(record)
    return album


def test_surfaces_are_those_of_the_records(relief):
    surfaces = album_of(relief).surfaces
    stages = relief.stages
    assert surfaces.names == tuple(stages)
    np.testing.assert_array_equal(surfaces.surface(0), stages["scene"].vertices)
    number = surfaces.names.index("attenuation")
    np.testing.assert_array_equal(surfaces.surface(number), stages["perspective"].vertices)
    for name in ("construction", "restoration", "order", "compression"):
        surface = surfaces.surface(surfaces.names.index(name))
        np.testing.assert_array_equal(surface[:, 2], stages[name].z)
        np.testing.assert_array_equal(surface[:, :2], stages["perspective"].vertices[:, :2])
    last = surfaces.surface(len(surfaces.names) - 1)
    np.testing.assert_array_equal(last[:, 2], np.maximum(stages["compression"].z, 0.0))


def test_before_is_the_last_surface_that_differs(relief):
    run = album_of(relief).run
    before = dict(zip(run.names, run.before, strict=True))
    assert before["scene"] is before["attenuation"] is None
    assert before["construction"] == run.names.index("attenuation")
    assert before["compression"] == before["order"]  # no compression was asked for


def test_cut_lies_in_the_relief_frame_over_its_welded_vertices(relief):
    cut = CutRelief.of(relief)
    scene = relief.stages["scene"]
    np.testing.assert_allclose(cut.vertices * scene.unit, np.asarray(relief.mesh.vertices))
    kept = relief.source_index >= 0
    np.testing.assert_array_equal(cut.welded[kept], scene.welded_index[relief.source_index[kept]])
    made = np.flatnonzero(~kept)
    assert len(made)
    distance = np.abs(cut.vertices[made, :2] - scene.vertices[cut.welded[made], :2])
    assert distance.max() < 10.0  # an end of the edge that was cut


def test_meanings_grow_with_the_stages(relief, scene):
    album = Album(vertex_colors(scene))
    known = []
    for record in relief.stages.values():
        album.add(record)
        known.append(len(album.run.meanings))
    assert known == sorted(known)
    assert known[0] == 3
    assert set(album.run.meanings) == {
        "shade", "cluster", "visible", "action", "order error", "displacement", INPUT_COLORS,
    }  # fmt: skip
    assert album.meaning(ViewerState(stage=2)) == "visible"


def test_bounded_runs_have_weights_and_no_clusters(bounded):
    album = album_of(bounded)
    assert set(album.run.meanings) == {"shade", "visible", "weight", "displacement"}
    assert not album.run.points
    number = album.run.names.index("bounded")
    assert album.meaning(ViewerState(stage=number)) == "weight"
    assert np.ptp(album.painted("weight", number).colors) > 0.3
    # A meaning that this run does not have, as after a key of another one.
    assert album.meaning(ViewerState(stage=0, meaning="cluster")) == "shade"


def test_colours_say_what_the_records_say(relief):
    album = album_of(relief)
    visible = relief.stages["visibility"].visible
    painted = album.painted("visible", 0)
    np.testing.assert_array_equal(painted.colors[visible], np.tile(SEEN, (visible.sum(), 1)))
    np.testing.assert_array_equal(painted.colors[~visible], np.tile(HIDDEN, ((~visible).sum(), 1)))
    assert painted.legend[0] == (SEEN, f"visible: {visible.sum()}")

    points = relief.stages["attenuation"]
    actions = album.painted("action", 0)
    for i, action in zip(points.index, points.action, strict=True):
        np.testing.assert_array_equal(actions.colors[i], ACTIONS[str(action)])

    labels = relief.stages["clusters"].labels
    clusters = album.painted("cluster", 0).colors
    for label in np.unique(labels):
        assert len(np.unique(clusters[labels == label], axis=0)) == 1

    assert album.painted("shade", 3).colors.tolist()[0] == list(PLASTER)


def test_displacement_has_one_range_for_all_stages(relief):
    album = album_of(relief)
    still = album.painted("displacement", 0)
    moved = album.painted("displacement", album.run.names.index("construction"))
    assert len(np.unique(still.colors, axis=0)) == 1  # nothing has moved: the middle of the map
    assert len(np.unique(moved.colors, axis=0)) > 100
    assert still.legend == moved.legend


def test_input_colours_find_their_welded_vertices(relief, scene):
    colors = vertex_colors(scene)
    np.testing.assert_allclose(colors, np.asarray(scene.vertex_colors), atol=1e-6)
    album = album_of(relief, colors)
    painted = album.painted(INPUT_COLORS, 0).colors
    np.testing.assert_allclose(painted[relief.stages["scene"].welded_index], colors, atol=1e-6)


def test_input_colours_of_the_relief_alone(relief):
    album = album_of(relief)
    assert INPUT_COLORS not in album.run.meanings
    cut = CutRelief.of(relief)
    album.finish(cut)
    painted = album.painted(INPUT_COLORS, 0).colors
    kept = relief.source_index >= 0
    np.testing.assert_allclose(painted[cut.welded][kept], cut.colors[kept], atol=1e-6)
    lost = np.setdiff1d(np.arange(len(painted)), cut.welded)
    assert len(lost)
    np.testing.assert_array_equal(painted[lost], np.tile(PLASTER, (len(lost), 1)))


def test_colours_of_another_mesh_are_not_shown(relief):
    album = Album(np.zeros((5, 3)))
    album.add(relief.stages["scene"])
    assert album.foreign_colors
    assert INPUT_COLORS not in album.run.meanings


def test_words(relief):
    album = album_of(relief)
    words = album.words(ViewerState(stage=4, points=True, wireframe=True))
    assert words.startswith("5/10 attenuation, ")
    assert words.endswith("s, colours: action, wireframe, points")
