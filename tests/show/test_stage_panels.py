"""The pictures of the stages that give the scene another shape, and what holds of all stages."""

import dataclasses

import numpy as np
import open3d as o3d
import pytest

from o3d_relief.errors import ParameterError
from o3d_relief.params import ReliefParams
from o3d_relief.pipeline import make_relief
from o3d_relief.records import BoundedStage, CompressionStage, OrderStage, PerspectiveStage, RestorationStage
from o3d_relief.show import stage_panels
from o3d_relief.show.render import render
from o3d_relief.show.sheets import stage_picture
from stage_records import make_stages

NAMES = list(make_stages())
SIZE = (168, 80)


@pytest.fixture(scope="module")
def stages():
    return make_stages()


@pytest.mark.parametrize("name", NAMES)
def test_every_stage_has_a_picture_of_two_panels(stages, name):
    image = stage_picture(name, stages, size=SIZE)
    assert image.shape == (80, 168, 3)
    assert image.dtype == np.uint8
    for panel in (image[:, :80], image[:, 88:]):
        drawn = np.abs(panel.astype(int) - (222, 222, 221)).max(axis=2) > 30
        assert 0.1 < drawn.mean() < 0.95


@pytest.mark.parametrize("name", NAMES[:-1])
def test_a_picture_needs_no_later_stage(stages, name):
    so_far = {key: stages[key] for key in NAMES[: NAMES.index(name) + 1]}
    assert np.array_equal(stage_picture(name, so_far, size=SIZE), stage_picture(name, stages, size=SIZE))


@pytest.mark.parametrize("name", NAMES)
def test_a_missing_record_is_named(name):
    with pytest.raises(ParameterError, match="has no record"):
        stage_picture(name, {}, size=SIZE)


def test_bounded_mode_has_a_picture_of_its_own(stages):
    scene, perspective = stages["scene"], stages["perspective"]
    z = 0.3 * perspective.vertices[:, 2]
    record = BoundedStage(face_weight=np.linspace(0.1, 1.0, len(scene.faces)), attached=np.array([3]), z=z)
    run = {"scene": scene, "perspective": perspective, "visibility": stages["visibility"], "bounded": record}
    assert stage_picture("bounded", run, size=SIZE).shape == (80, 168, 3)
    assert stage_picture("trim", {**run, "trim": stages["trim"]}, size=SIZE).shape == (80, 168, 3)
    with pytest.raises(ParameterError, match="has no record"):
        stage_picture("bounded", {}, size=SIZE)


def test_the_perspective_shows_a_change_and_says_where_there_is_none(stages):
    changed = stage_picture("perspective", stages, size=SIZE)
    assert not np.array_equal(changed[20:, :80], changed[20:, 88:])
    same = {**stages, "perspective": PerspectiveStage(vertices=stages["scene"].vertices.copy())}
    unchanged = stage_picture("perspective", same, size=SIZE)
    assert np.array_equal(unchanged[20:, :80], unchanged[20:, 88:])


def test_the_order_error_is_hot_where_it_is(stages):
    image = stage_picture("restoration", stages, size=(408, 200)).astype(int)
    left = image[20:, :140]
    hot = left[..., 0] > 1.8 * left[..., 2]
    assert hot.sum() > 20
    without = {
        **stages,
        "restoration": RestorationStage(
            order_error=np.zeros(len(stages["scene"].vertices)),
            solved=np.zeros(len(stages["scene"].vertices), dtype=bool),
            z=stages["restoration"].z.copy(),
        ),
    }
    left = stage_picture("restoration", without, size=(408, 200)).astype(int)[20:, :140]
    assert not np.any(left[..., 0] > 1.8 * left[..., 2])


def test_the_trimmed_relief_is_drawn_where_it_is_given(stages):
    box = o3d.geometry.TriangleMesh.create_box(10, 10, 3)
    given = stage_picture("trim", stages, relief=box, size=SIZE)
    assert not np.array_equal(given, stage_picture("trim", stages, size=SIZE))


@pytest.fixture
def drawn(monkeypatch):
    """Return the options of each render, as they come."""
    options = []
    monkeypatch.setattr(stage_panels, "render", lambda *a, **o: options.append(o) or render(*a, **o))
    return options


@pytest.mark.parametrize("name", ["perspective", "order", "compression"])
def test_what_is_the_same_before_and_after_is_drawn_once(stages, drawn, name):
    z = stages["restoration"].z
    same = {
        **stages,
        "perspective": PerspectiveStage(vertices=stages["scene"].vertices.copy()),
        "order": OrderStage(z=z.copy()),
        "compression": CompressionStage(alpha=np.ones(len(z)), z=z.copy()),
    }
    image = stage_picture(name, same, size=(408, 200))
    assert len(drawn) == 1
    assert np.array_equal(image[30:, :200], image[30:, 208:])  # below the titles
    assert not np.array_equal(image[:30, :200], image[:30, 208:])
    stage_picture(name, stages, size=SIZE)
    assert len(drawn) == 3


def test_an_order_that_was_not_asked_for_is_not_said_to_be_kept(stages, monkeypatch):
    titles = []
    told = stage_panels.annotate
    monkeypatch.setattr(stage_panels, "annotate", lambda *a, **o: titles.append(o["title"]) or told(*a, **o))
    ball = o3d.geometry.TriangleMesh.create_sphere(50.0, 6)
    for params, sentence in (
        (ReliefParams.paper(k=4), "order not asked for: unchanged"),
        (ReliefParams(k=4), "in order: nothing had to be moved"),
    ):
        stage_picture("order", make_relief(ball, params).stages, size=SIZE)
        assert titles[-2:] == ["before", sentence]


@pytest.mark.parametrize(
    ("name", "title"),
    [
        ("restoration", "no depth order errors"),
        ("bounded", ", shape unchanged"),
    ],
)
def test_no_scale_where_nothing_stands_out(stages, drawn, name, title):
    z, n = stages["perspective"].vertices[:, 2], len(stages["scene"].vertices)
    weight = np.ones(len(stages["scene"].faces))
    bounded = BoundedStage(face_weight=weight, attached=np.array([3]), z=0.3 * z)
    restored = stages["restoration"]
    moving = {**stages, "bounded": bounded}
    still = {
        "restoration": dataclasses.replace(restored, order_error=np.zeros(n), solved=np.zeros(n, dtype=bool)),
        "bounded": dataclasses.replace(bounded, z=z - 2.0),
    }
    for record, moves in ((moving[name], True), (still[name], False)):
        drawn.clear()
        stage_picture(name, {**stages, name: record}, size=SIZE)
        labels = ("order error", "moved")
        panel = next(options for options in drawn if options.get("field_label") in labels)
        assert (panel["field"] is not None) == moves
        assert (title in panel["title"]) != moves
