"""Sheets and stage pictures: the right size, the right place, and telling apart what differs."""

from __future__ import annotations

import numpy as np
import open3d as o3d
import pytest
from PIL import Image

from o3d_relief.errors import FileError, ParameterError
from o3d_relief.show.sheets import contact_sheet, save_stage_pictures, stage_picture, view_sheet
from stage_records import make_sphere, make_stages

SIZE = (168, 80)


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


def test_an_unknown_stage_raises(stages):
    with pytest.raises(ParameterError, match=r"name must be one of points, .*Got 'carving' instead"):
        stage_picture("carving", stages, size=SIZE)


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
