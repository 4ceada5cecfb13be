"""Sheets and stage pictures: the right size, the right place, and telling apart what differs."""

from __future__ import annotations

import dataclasses

import numpy as np
import open3d as o3d
import pytest
from PIL import Image

from o3d_relief.errors import FileError, ParameterError
from o3d_relief.params import ReliefParams
from o3d_relief.pipeline import make_relief
from o3d_relief.records import (
    AttenuationStage,
    BoundedStage,
    ClustersStage,
    CompressionStage,
    ConstructionStage,
    OrderStage,
    PerspectiveStage,
    RestorationStage,
    SceneStage,
    TrimStage,
    VisibilityStage,
)
from o3d_relief.show import stage_panels
from o3d_relief.show.render import render
from o3d_relief.show.sheets import contact_sheet, save_stage_pictures, stage_picture, view_sheet

NAMES = [
    "scene",
    "perspective",
    "visibility",
    "clusters",
    "attenuation",
    "construction",
    "restoration",
    "order",
    "compression",
    "trim",
]
SIZE = (168, 80)


def make_sphere(depth=1.0):
    """Return a ball of diameter 100, flattened in depth, that stands on z = 0."""
    sphere = o3d.geometry.TriangleMesh.create_sphere(50.0, 10)
    vertices = np.asarray(sphere.vertices) * [1.0, 1.0, depth]
    vertices[:, 2] -= vertices[:, 2].min()
    return vertices, np.asarray(sphere.triangles).astype(np.int64)


def make_stages():
    vertices, faces = make_sphere()
    n = len(vertices)
    z = 0.5 * vertices[:, 2]
    labels = (vertices[:, 0] > 0).astype(np.int64) + 2 * (vertices[:, 1] > 0)
    index = np.array([0, 20, 40, 60])
    action = np.array(["attach", "scale", "discard", "scale"])
    error = np.zeros(n)
    error[np.argmax(vertices[:, 2])] = 0.8
    records = [
        SceneStage(
            vertices=vertices.copy(),
            faces=faces,
            welded_index=np.arange(n),
            welded_face=np.arange(len(faces)),
            unit=1.0,
        ),
        PerspectiveStage(vertices=vertices * [0.8, 0.8, 1.0]),
        VisibilityStage(visible=vertices[:, 2] > 50.0),
        ClustersStage(labels=labels, centers=np.array([[-25.0, -25], [25, -25], [-25, 25], [25, 25]])),
        AttenuationStage(
            index=index,
            cluster=np.arange(4),
            height=vertices[index, 2],
            differential=np.full(4, 0.5),
            rho=np.full(4, 0.5),
            beta=np.full(4, 0.2),
            action=action,
            new_height=np.where(action == "discard", np.nan, 0.5 * vertices[index, 2]),
        ),
        ConstructionStage(z=z - 3.0),
        RestorationStage(order_error=error, solved=error > 0.2, z=z),
        OrderStage(z=z + 2.0 * (labels == 0), counts={"pairs_corrected": 7}),
        CompressionStage(alpha=np.full(n, 0.5), z=0.5 * z),
        TrimStage(),
    ]
    return {record.name: record for record in records}


@pytest.fixture(scope="module")
def stages():
    return make_stages()


# --- contact sheets ------------------------------------------------------------------------------


def plain(color, width=30, height=20):
    return np.full((height, width, 3), color, dtype=np.uint8)


def test_a_contact_sheet_keeps_its_pictures_in_order():
    sheet = contact_sheet([plain(10), plain(20), plain(30)], 2, gap=4)
    assert sheet.shape == (44, 64, 3)
    assert np.all(sheet[:20, :30] == 10)
    assert np.all(sheet[:20, 34:] == 20)
    assert np.all(sheet[24:, :30] == 30)
    assert np.all(sheet[24:, 34:] == (222, 222, 221))


def test_titles_and_labels_get_room_beside_the_pictures():
    images = [plain(10, 200, 100)] * 2
    sheet = contact_sheet(images, 1, titles=["first", ""], row_labels=["above", "below"], gap=0)
    inside = np.all(sheet == 10, axis=2)
    assert inside.sum() == 2 * 200 * 100
    rows, columns = np.nonzero(inside)
    assert rows.min() > 10  # the title
    assert columns.min() > 10  # the labels
    assert sheet.shape[0] == rows.min() + 200  # a row without a title has no room for one
    assert np.any(sheet[: rows.min(), columns.min() :] < 100)
    assert np.any(sheet[:, : columns.min()] < 100)


@pytest.mark.parametrize(
    ("images", "columns", "options", "message"),
    [
        ([], 1, {}, "needs pictures"),
        ([plain(0), plain(0, 31)], 2, {}, "all of one size"),
        ([plain(0)], 0, {}, "columns"),
        ([plain(0)], 1.5, {}, "columns must be a whole number"),
        ([plain(0) / 255.0], 1, {}, "image must be"),
        ([np.zeros((4, 4, 3))], 1, {}, "float64 instead"),
        ([1], 1, {}, "image must be"),
        ([plain(0)], 1, {"titles": [16]}, "must be text"),
        ([plain(0)], 1, {"titles": ["a", "b"]}, "title for each"),
        ([plain(0)], 1, {"row_labels": ["a", "b"]}, "label for each"),
    ],
)
def test_a_sheet_that_cannot_be_laid_out_raises(images, columns, options, message):
    with pytest.raises(ParameterError, match=message):
        contact_sheet(images, columns, **options)


def test_pictures_may_be_one_array():
    images = np.stack([plain(0), plain(9)])
    assert np.array_equal(contact_sheet(images, np.int64(2)), contact_sheet(list(images), 2))


def test_a_view_sheet_shows_both_rows_at_one_scale():
    scene, relief = o3d.geometry.TriangleMesh(), o3d.geometry.TriangleMesh()
    for mesh, depth in ((scene, 1.0), (relief, 0.3)):
        vertices, faces = make_sphere(depth)
        mesh.vertices = o3d.utility.Vector3dVector(vertices)
        mesh.triangles = o3d.utility.Vector3iVector(faces.astype(np.int32))
        mesh.paint_uniform_color((1.0, 0.1, 0.1))  # to tell it from the plate
    sheet = view_sheet(scene, relief, yaws=(0, 60), panel=(120, 120)).astype(int)
    red = sheet[..., 0] > 1.6 * sheet[..., 1]
    left = sheet.shape[1] - 2 * 120 - 8
    half = sheet.shape[0] // 2
    extents = []
    for rows in (slice(0, half), slice(half, None)):
        for first in (left, left + 128):
            seen = np.nonzero(red[rows, first : first + 120])
            extents.append((np.ptp(seen[0]) + 1, np.ptp(seen[1]) + 1))
    heights = [height for height, _ in extents]
    assert max(heights) - min(heights) <= 4  # the same ball, equally high in all four pictures
    assert abs(extents[0][1] - extents[2][1]) <= 3  # and equally wide from the front
    assert extents[3][1] < 0.8 * extents[1][1]  # but the relief is flatter


# --- stage pictures ------------------------------------------------------------------------------


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


def test_an_unknown_stage_raises(stages):
    with pytest.raises(ParameterError, match=r"name must be one of points, .*Got 'carving' instead"):
        stage_picture("carving", stages, size=SIZE)


def test_visible_and_hidden_have_two_colors(stages):
    image = stage_picture("visibility", stages, size=(408, 200)).astype(int)
    warm = image[..., 0] > 1.3 * image[..., 2]
    cold = image[..., 2] > 1.3 * image[..., 0]
    front, side = slice(0, 200), slice(208, 408)
    surface = slice(20, 170)  # without the legend
    assert warm[surface, front].sum() > 20 * max(cold[surface, front].sum(), 1)
    assert warm[surface, side].sum() > 1000
    assert cold[surface, side].sum() > 1000


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


def test_the_trimmed_relief_is_drawn_where_it_is_given(stages):
    box = o3d.geometry.TriangleMesh.create_box(10, 10, 3)
    given = stage_picture("trim", stages, relief=box, size=SIZE)
    assert not np.array_equal(given, stage_picture("trim", stages, size=SIZE))


def test_the_records_stay_as_they_are(stages):
    before = stages["scene"].vertices.copy()
    for name in ("scene", "clusters"):
        stage_picture(name, stages, size=SIZE)
    assert np.array_equal(before, stages["scene"].vertices)
    assert not stages["scene"].vertices.flags.writeable


def test_saved_pictures_are_numbered_by_stage(stages, tmp_path):
    chosen = {name: stages[name] for name in ("scene", "perspective", "construction")}
    paths = save_stage_pictures(chosen, tmp_path, size=SIZE)
    assert [path.name for path in paths] == ["01_scene.png", "02_perspective.png", "06_construction.png"]
    assert sorted(path.name for path in tmp_path.iterdir()) == [path.name for path in paths]
    with Image.open(paths[0]) as picture:
        assert np.array_equal(np.asarray(picture), stage_picture("scene", stages, size=SIZE))


def test_saving_into_a_missing_folder_raises(stages, tmp_path):
    with pytest.raises(FileError, match="does not exist"):
        save_stage_pictures(stages, tmp_path / "nowhere", size=SIZE)
    assert list(tmp_path.iterdir()) == []


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
    ("name", "field", "title"),
    [
        ("attenuation", "point_field", "new heights: all 0, "),
        ("restoration", "field", "no depth order errors"),
        ("bounded", "field", ", shape unchanged"),
    ],
)
def test_no_scale_where_nothing_stands_out(stages, drawn, name, field, title):
    z, n = stages["perspective"].vertices[:, 2], len(stages["scene"].vertices)
    weight = np.ones(len(stages["scene"].faces))
    bounded = BoundedStage(face_weight=weight, attached=np.array([3]), z=0.3 * z)
    restored = stages["restoration"]
    moving = {**stages, "bounded": bounded}
    still = {
        "attenuation": dataclasses.replace(stages["attenuation"], new_height=np.zeros(4)),
        "restoration": dataclasses.replace(restored, order_error=np.zeros(n), solved=np.zeros(n, dtype=bool)),
        "bounded": dataclasses.replace(bounded, z=z - 2.0),
    }
    for record, moves in ((moving[name], True), (still[name], False)):
        drawn.clear()
        stage_picture(name, {**stages, name: record}, size=SIZE)
        labels = ("new height", "order error", "moved")
        panel = next(options for options in drawn if options.get("field_label") in labels)
        assert (panel[field] is not None) == moves
        assert (title in panel["title"]) != moves
