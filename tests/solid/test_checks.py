import numpy as np
import pytest
import trimesh

from o3d_relief.plate_params import PlateParams
from o3d_relief.solid.body import Solid
from o3d_relief.solid.checks import check_solid
from o3d_relief.solid.measures import wall_thickness


def _solid(mesh, **counts):
    faces = np.array(mesh.faces)
    return Solid(
        vertices=np.array(mesh.vertices), faces=faces, is_plate=np.ones(len(faces), dtype=bool), counts=counts
    )


def _box(low, high):
    return trimesh.creation.box(bounds=[low, high])


PARAMS = PlateParams(width_mm=40, depth_mm=10, base_mm=4)


def test_a_block_passes():
    report = check_solid(_solid(_box([-20, -10, -4], [20, 10, 6])), PARAMS)
    assert report.verdict == "pass"
    assert report.failures == report.warnings == ()
    assert report.size_mm == (40.0, 20.0, 10.0)
    assert report.volume_mm3 == pytest.approx(8000.0)
    assert report.area_mm2 == pytest.approx(2 * (800 + 400 + 200))
    assert report.thinnest_mm == pytest.approx(10.0, abs=1e-3)
    assert report.overhang_area_mm2 == 0.0
    assert report.overlap_share == 0.0
    assert report.back_deviation_mm == 0.0
    assert report.values()["bodies"] == 1


def test_walls_are_measured_straight_through():
    walls = wall_thickness(_solid(_box([0, 0, 0], [10, 5, 0.7])))
    assert np.unique(walls.round(3)).tolist() == [0.7, 5.0, 10.0]


def test_thin_walls_warn():
    slab = trimesh.util.concatenate([_box([-20, -10, -4], [20, 10, 5]), _box([-20, -10, 5.5], [20, 10, 6])])
    report = check_solid(_solid(slab), PARAMS)
    assert report.verdict == "warnings"
    assert report.thin_area_mm2 == pytest.approx(2 * 800)
    assert "1600 mm2 of" in report.warnings[1]
    assert "1 parts touch nothing" in report.warnings[0]


@pytest.mark.parametrize(
    ("loose", "advice"),
    [
        ("report", "in all: loose='bridge' ties them, loose='remove' leaves them out."),
        ("bridge", "in all, and nothing lies behind them to tie them to: loose='remove' leaves them out."),
        ("remove", "in all."),
    ],
)
def test_only_what_is_loose_is_told_and_what_can_still_be_done(loose, advice):
    hollow = _box([-5, -5, -1], [5, 5, 3])
    hollow.invert()
    block = trimesh.util.concatenate([_box([-20, -10, -4], [20, 10, 5]), hollow])
    params = PlateParams(width_mm=40, depth_mm=9, loose=loose)
    alone = check_solid(_solid(block), params)
    assert alone.bodies == 1  # a void is no part
    assert "touch nothing" not in " ".join(alone.warnings)
    params = PlateParams(width_mm=40, depth_mm=13, loose=loose)
    report = check_solid(_solid(trimesh.util.concatenate([block, _box([0, 0, 7], [2, 5, 9])])), params)
    assert report.bodies == 2
    assert report.warnings[0] == f"1 parts touch nothing, 20 mm3 {advice}"


@pytest.mark.parametrize(("direction", "area"), [("z", 200.0), ("y", 30.0), ("x", 30.0)])
def test_overhangs_in_each_print_direction(direction, area):
    # A table: its underside needs support when it stands on its back, its foot's side when it lies.
    table = trimesh.util.concatenate([_box([-20, -10, -4], [20, 10, 0]), _box([-10, -5, 3], [10, 5, 6])])
    report = check_solid(_solid(table), PlateParams(width_mm=40, depth_mm=10, print_direction=direction))
    assert report.overhang_area_mm2 == pytest.approx(area if direction != "y" else 60.0)


def test_surfaces_that_pass_through_each_other_warn():
    pair = trimesh.util.concatenate([_box([-20, -10, -4], [5, 10, 6]), _box([-5, -10, -4], [20, 10, 6])])
    report = check_solid(_solid(pair), PARAMS)
    assert report.overlap_share == pytest.approx(10 / 40, rel=0.02)
    assert "Surfaces pass through each other: 25" in report.warnings[-1]


def test_a_missing_face_fails():
    block = _box([-20, -10, -4], [20, 10, 6])
    block.update_faces(np.arange(len(block.faces)) != 3)
    report = check_solid(_solid(block), PARAMS)
    assert report.verdict == "fail"
    assert not report.watertight
    assert "not watertight" in report.failures[0]


def test_a_turned_face_fails():
    block = _box([-20, -10, -4], [20, 10, 6])
    block.faces[3] = block.faces[3][::-1]
    report = check_solid(_solid(block), PARAMS)
    assert report.watertight
    assert report.failures == ("The faces do not all turn outward.",)


def test_inside_out_fails():
    block = _box([-20, -10, -4], [20, 10, 6])
    block.invert()
    report = check_solid(_solid(block), PARAMS)
    assert report.failures[0] == "The faces do not all turn outward."
    assert "The volume is not positive" in report.failures[1]
    assert report.bodies == 1


def test_a_part_that_is_inside_out_is_no_void():
    plate, arch = _box([-20, -10, -4], [20, 10, 5]), _box([-20, -10, 5], [-18, -8, 12])
    body = trimesh.boolean.union([plate, arch], engine="manifold")  # its box reaches round the part in front
    turned = _box([0, 0, 7], [2, 5, 9])
    turned.invert()
    params = PlateParams(width_mm=40, depth_mm=16)
    report = check_solid(_solid(trimesh.util.concatenate([body, turned])), params)
    assert report.verdict == "fail"
    assert report.failures == ("The faces do not all turn outward.",)
    assert report.bodies == 2
    assert report.warnings[0].startswith("1 parts touch nothing, 20 mm3 in all")


def test_wrong_sizes_fail():
    report = check_solid(_solid(_box([-19, -10, -4], [20, 10, 7])), PARAMS)
    assert report.failures == (
        "The solid is 39.000 mm wide, not 40 mm.",
        "The solid is 11.000 mm deep, not 10 mm.",
    )


def test_an_uneven_back_fails():
    block = _box([-20, -10, -4], [20, 10, 6])
    block.vertices[0, 2] += 1e-4
    assert "The back is uneven by 0.0001 mm." in check_solid(_solid(block), PARAMS).failures
    ball = trimesh.creation.icosphere(2, 20.0)
    assert "The solid has no flat back." in check_solid(_solid(ball), PARAMS).failures


def test_a_stretched_relief_warns():
    block = _solid(_box([-20, -10, -4], [20, 10, 6]), depth_ratio=1.5)
    assert check_solid(block, PARAMS).warnings == (
        "The relief is shallower than asked for: its depth is stretched by 1.50.",
    )
