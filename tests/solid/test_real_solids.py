"""Every real mesh, as a solid on two kinds of plate."""

import numpy as np
import pytest
import trimesh

import o3d_relief as rel
from o3d_relief.solid.estimate import estimate_solid, relief_depth
from real_meshes import VIEWS, real_relief, real_view

pytestmark = [pytest.mark.data, pytest.mark.slow]

COLORED = {"gargoyle_vertexcolor.ply", "robot_steampunk_textured.glb", "scene_macross_city.glb"}
ONE_PIECE = {"bust_igea.ply", "gargoyle_vertexcolor.ply", "lucy_100k.ply"}
# The bust again, as triangle strips: that it is the same mesh is tested with the readers.
NAMES = [name for name in VIEWS if name != "igea_tristrips_original.ply"]


def _params(shape, loose="report"):
    return rel.PlateParams(width_mm=150, depth_mm=25, shape=shape, loose=loose)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("shape", ["rectangle", "contour"])
def test_every_mesh_becomes_a_solid(data_folder, name, shape):
    bridged = name == "robot_steampunk_textured.glb" and shape == "contour"
    params = _params(shape, "bridge" if bridged else "report")
    solid = rel.make_solid(real_relief(data_folder, name), params)
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
    assert not bridged or solid.counts["pins"] == solid.counts["loose_bodies"] > 0
    assert report.bodies == 1 or not (bridged or name in ONE_PIECE)
    assert (solid.colors is not None) == (name in COLORED)


def test_a_relief_of_the_right_depth_is_not_stretched(data_folder):
    name, params = "statue_penelope.ply", _params("rectangle")
    mesh, view = rel.read_mesh(data_folder / name), real_view(name)
    asked = rel.ReliefParams(depth=relief_depth(mesh, view, params))
    solid = rel.make_solid(rel.make_relief(mesh, asked, view=view), params)
    assert solid.counts["depth_ratio"] == pytest.approx(1.0, abs=0.02)
    estimate = estimate_solid(mesh, asked, view, params)
    np.testing.assert_allclose(solid.size, estimate.size, rtol=0.02)
    assert estimate.volume_mm3 == pytest.approx(solid.volume, rel=0.3)
