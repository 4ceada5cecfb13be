import manifold3d
import numpy as np
import pytest
import trimesh

from o3d_relief.errors import MeshError
from o3d_relief.solid.body import Solid
from o3d_relief.solid.distinct import distinct
from slabs import ball_on_slab, plain, plate


def _welded(solid):
    """The solid as a program sees it that reads positions in float32."""
    corners = solid.vertices.astype(np.float32)[solid.faces].reshape(-1, 3)
    return trimesh.Trimesh(corners, np.arange(len(corners)).reshape(-1, 3), process=True)


def _touching():
    """Two boxes on a plate that touch in an upright edge, and a third that touches one of them above."""
    cube = manifold3d.Manifold.cube([10.0, 10.0, 12.0])
    boxes = plain(cube.translate([0.0, 0.0, -2.0])) + plain(cube.translate([-10.0, -10.0, -2.0]))
    return Solid.from_manifold(plate() + boxes, colored=False)


def test_parts_that_touch_in_an_edge_come_apart():
    solid = _touching()
    assert not _welded(solid).is_watertight  # an edge with four faces
    apart = distinct(solid)
    assert _welded(apart).is_watertight
    np.testing.assert_array_equal(apart.faces, solid.faces)
    np.testing.assert_array_equal(apart.is_plate, solid.is_plate)
    assert np.abs(apart.vertices - solid.vertices).max() < 0.001
    assert (apart.vertices != solid.vertices).any(axis=1).sum() <= 4
    assert apart.volume == pytest.approx(solid.volume, rel=1e-6)
    # Nothing overlaps: the gap is open.
    assert apart.volume < solid.volume
    assert apart.to_manifold().status() == manifold3d.Error.NoError


def test_the_back_stays_flat():
    cube = manifold3d.Manifold.cube([10.0, 10.0, 12.0])
    boxes = plain(cube) + plain(cube.translate([-10.0, -10.0, 0.0]))
    apart = distinct(Solid.from_manifold(boxes, colored=False))
    assert _welded(apart).is_watertight
    assert (apart.vertices[:, 2] == 0.0).sum() == 8


def test_detail_finer_than_float32_is_moved_apart():
    spike = manifold3d.Manifold.cube([2e-5, 2e-5, 5.0]).translate([0.0, 0.0, -1.0])
    made = (plate(base=2.0) + plain(spike)).translate([1000.0, 1000.0, 0.0])
    fine = Solid.from_manifold(made, colored=False)
    rounded = fine.vertices.astype(np.float32)
    assert len(np.unique(rounded, axis=0)) < len(rounded)
    apart = distinct(fine)
    places = apart.vertices.astype(np.float32)
    assert len(np.unique(places, axis=0)) == len(places)
    assert apart.volume == pytest.approx(fine.volume, rel=1e-4)
    assert np.abs(apart.vertices - fine.vertices).max() < 0.005


def test_detail_that_float32_cannot_hold_is_an_error():
    near = ball_on_slab()
    far = Solid(vertices=near.vertices + 1e9, faces=near.faces, is_plate=near.is_plate)
    with pytest.raises(MeshError, match="closer together than files in float32 can hold"):
        distinct(far)


def test_solids_without_such_vertices_stay_as_they_are():
    solid = ball_on_slab()
    assert distinct(solid) is solid


def test_vertices_near_zero_that_only_float32_tells_apart_are_moved():
    # The ends of two spikes meet at the height of zero, but for less than programs tell apart.
    up = manifold3d.Manifold.cylinder(5.0, 0.0, 3.0, 4).translate([0.0, 0.0, 1e-9])
    down = manifold3d.Manifold.cylinder(5.0, 3.0, 0.0, 4).translate([0.0, 0.0, -5.0])
    solid = Solid.from_manifold(plain(up) + plain(down), colored=False)
    tips = np.abs(solid.vertices).max(axis=1) < 1e-6
    assert tips.sum() == 2
    assert len(np.unique(solid.vertices[tips].astype(np.float32), axis=0)) == 2
    apart = distinct(solid)
    gaps = np.linalg.norm(apart.vertices[tips][0] - apart.vertices[tips][1])
    assert 1e-6 < gaps < 0.001
