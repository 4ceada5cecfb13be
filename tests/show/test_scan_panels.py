"""The pictures of the stages of a scan."""

import numpy as np
import open3d as o3d
import pytest

from o3d_relief.errors import ParameterError
from o3d_relief.scan_params import ScanParams
from o3d_relief.scene.scan import scan_points
from o3d_relief.show.scan_panels import SCAN_PANELS
from o3d_relief.show.sheets import save_stage_pictures, stage_picture
from shapes import hills

SIZE = (328, 160)
NAMES = ["points", "outliers", "normals", "ground", "orientation", "surface", "skin", "parts"]


@pytest.fixture(scope="module")
def scan():
    points = np.concatenate([hills(40)[0], [[0, 0, 150.0], [10, 0, 150], [0, 9, 160]]])
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    cloud.colors = o3d.utility.Vector3dVector(np.tile([0.9, 0.1, 0.1], (len(points), 1)))
    return scan_points(cloud, ScanParams(max_hole=4.0))


def reddish(picture):
    values = picture.astype(int)
    return int((values[..., 0] > 2 * values[..., 1]).sum())


def test_each_stage_has_panels_in_order(scan):
    assert list(SCAN_PANELS) == list(scan.stages) == NAMES


@pytest.mark.parametrize("name", NAMES)
def test_a_picture_needs_no_later_stage(scan, name):
    so_far = {key: scan.stages[key] for key in NAMES[: NAMES.index(name) + 1]}
    picture = stage_picture(name, so_far, size=SIZE)
    assert picture.shape == (160, 328, 3)
    assert picture.std() > 10


@pytest.mark.parametrize("name", NAMES)
def test_a_missing_record_is_named(name):
    with pytest.raises(ParameterError, match="has no record"):
        stage_picture(name, {}, size=SIZE)


def test_points_and_mesh_are_drawn_in_their_colors_and_outliers_in_red(scan):
    assert reddish(stage_picture("points", scan.stages, size=SIZE)) > 3000
    assert reddish(stage_picture("parts", scan.stages, size=SIZE)) > 5000
    assert scan.stages["outliers"].counts["outliers"] == 3
    assert 5 < reddish(stage_picture("outliers", scan.stages, size=SIZE)) < 1500


def test_many_points_are_thinned_for_the_picture(scan, monkeypatch):
    whole = stage_picture("points", scan.stages, size=SIZE)
    monkeypatch.setattr("o3d_relief.show.scan_panels._MOST_DOTS", 500)
    fewer = stage_picture("points", scan.stages, size=SIZE)
    assert 0.5 * reddish(whole) < reddish(fewer) < 1.5 * reddish(whole)


def test_the_pictures_of_a_scan_come_first(tmp_path, scan):
    stages = {name: scan.stages[name] for name in ("points", "parts")}
    paths = save_stage_pictures(stages, tmp_path, size=SIZE)
    assert [path.name for path in paths] == ["01_points.png", "08_parts.png"]
