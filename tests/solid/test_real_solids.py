"""Every real mesh, as a solid on two kinds of plate."""

import functools

import numpy as np
import pytest
import trimesh

import o3d_relief as rel
from o3d_relief.solid.estimate import relief_depth

pytestmark = [pytest.mark.data, pytest.mark.slow]

VIEWS = {
    "broken_chair.obj": ("z", "y"),
    "bunny_zipper.ply": ("z", "y"),
    "bust_igea.ply": ("z", "y"),
    "dragon_full_871k.ply": ("z", "y"),
    "dragon_res2.ply": ("z", "y"),
    "gargoyle_vertexcolor.ply": ("z", "y"),
    "igea_tristrips_original.ply": ("z", "y"),
    "lucy_100k.ply": ("y", "z"),
    "robot_steampunk_textured.glb": ("z", "y"),
    "scene_japanese_temple.obj": ("z", "y"),
    "scene_macross_city.glb": ("z", "y"),
    "statue_penelope.ply": ("z", "y"),
}
COLORED = {"gargoyle_vertexcolor.ply", "robot_steampunk_textured.glb", "scene_macross_city.glb"}


@pytest.fixture(scope="module")
def made(data_folder):
    @functools.cache
    def make(name):
        front, up = VIEWS[name]
        mesh, view = rel.read_mesh(data_folder / name), rel.View(front=front, up=up)
        depth = relief_depth(mesh, view, _params("rectangle"))
        return rel.make_relief(mesh, rel.ReliefParams(depth=depth), view=view)

    return make


def _params(shape):
    return rel.PlateParams(width_mm=150, depth_mm=25, shape=shape)


@pytest.mark.parametrize("shape", ["rectangle", "contour"])
@pytest.mark.parametrize("name", VIEWS)
def test_every_mesh_becomes_a_solid(made, name, shape):
    params = _params(shape)
    solid = rel.make_solid(made(name), params)
    assert solid.to_manifold().num_tri() > 0  # raises where it is not a manifold
    seen = trimesh.Trimesh(solid.vertices, solid.faces, process=False)
    assert seen.is_watertight
    assert seen.is_winding_consistent
    assert seen.volume > 0.0
    assert seen.extents[[0, 2]] == pytest.approx([150.0, 25.0], abs=0.01)
    back = seen.triangles[seen.face_normals[:, 2] < -0.999999][:, :, 2]
    assert np.abs(back[back.max(axis=1) < -3.9] + 4.0).max() <= 1e-6
    report = rel.check_solid(solid, params)
    assert report.verdict != "fail"
    assert report.overlap_share < 2e-3
    assert solid.counts["depth_ratio"] == pytest.approx(1.0, abs=0.02)
    assert (solid.colors is not None) == (name in COLORED)


@pytest.mark.parametrize("name", ["gargoyle_vertexcolor.ply", "lucy_100k.ply", "bust_igea.ply"])
def test_single_bodies_stay_one(made, name):
    assert rel.check_solid(rel.make_solid(made(name), _params("contour")), _params("contour")).bodies == 1


def test_loose_parts_are_bridged(made):
    params = rel.PlateParams(width_mm=150, depth_mm=25, loose="bridge")
    solid = rel.make_solid(made("robot_steampunk_textured.glb"), params)
    assert solid.counts["pins"] == solid.counts["loose_bodies"] > 0
    assert rel.check_solid(solid, params).bodies == 1
