"""Milling, tiles and files of the solids of real meshes."""

import manifold3d
import numpy as np
import pytest
import trimesh

from o3d_relief.plate_params import PlateParams
from o3d_relief.solid.formats import write_solid
from o3d_relief.solid.make import make_solid
from o3d_relief.solid.milling import ball_closing
from o3d_relief.workshop import work_on
from o3d_relief.workshop_params import MillParams, TileParams
from real_meshes import real_relief

pytestmark = [pytest.mark.data, pytest.mark.slow]


@pytest.mark.parametrize(
    ("name", "shape"),
    [
        ("gargoyle_vertexcolor.ply", "ellipse"),
        ("robot_steampunk_textured.glb", "contour"),
        ("lucy_100k.ply", "rectangle"),
    ],
)
def test_real_reliefs_go_through_the_workshop(data_folder, tmp_path, name, shape):
    plate = PlateParams(width_mm=150, depth_mm=30, base_mm=5, shape=shape, loose="bridge")
    solid = make_solid(real_relief(data_folder, name), plate)
    mill = MillParams(mm_per_pixel=0.5, tool_mm=3, draft_deg=3, keep_ridges=True)
    tiles = TileParams(width_mm=90, height_mm=90)
    work = work_on(solid, mill=mill, undercut_free=True, tiles=tiles)
    np.testing.assert_allclose(work.solid.size, solid.size, atol=0.01)
    np.testing.assert_allclose(ball_closing(work.field.z, 1.5, 0.5), work.field.z, atol=1e-9)
    cut = work_on(solid, mill=None, undercut_free=False, tiles=tiles).tiling
    assert cut.counts["pins"] > 2
    for made in [solid, work.solid, *(tile.solid for tile in (*cut.tiles, *work.tiling.tiles))]:
        assert made.to_manifold().status() == manifold3d.Error.NoError
        assert made.volume > 0.0
    for tile in (*cut.tiles, *work.tiling.tiles):
        assert (tile.solid.size[:2] <= 90.0 + 1e-9).all()
    for number, made in enumerate((solid, work.solid, cut.tiles[0].solid)):
        path = tmp_path / f"{number}.stl"
        write_solid(path, made)
        read = trimesh.load(path)
        assert read.is_watertight
        assert read.volume == pytest.approx(made.volume, rel=1e-4)
