import numpy as np
import open3d as o3d

from o3d_relief.show.mesh_colors import vertex_colors
from o3d_relief.show.paint import PLASTER


def square():
    return o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector(np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (9, 9, 9.0)])),
        o3d.utility.Vector3iVector(np.array([(0, 1, 2), (0, 2, 3)], dtype=np.int32)),
    )


def test_no_colours():
    assert vertex_colors(square()) is None


def test_vertex_colours_come_back():
    mesh = square()
    colors = np.random.default_rng(0).random((5, 3))
    mesh.vertex_colors = o3d.utility.Vector3dVector(colors)
    found = vertex_colors(mesh)
    np.testing.assert_allclose(found[:4], colors[:4], atol=1e-6)
    np.testing.assert_array_equal(found[4], PLASTER)  # no face uses it


def test_a_texture_is_read_at_the_corners():
    mesh = square()
    corners = np.array([(0.25, 0.25), (0.75, 0.25), (0.75, 0.75), (0.25, 0.75)])
    mesh.triangle_uvs = o3d.utility.Vector2dVector(corners[[0, 1, 2, 0, 2, 3]])
    texture = np.array([[(255, 0, 0), (0, 255, 0)], [(0, 0, 255), (255, 255, 0)]], dtype=np.uint8)
    mesh.textures = [o3d.geometry.Image(texture)]
    mesh.triangle_material_ids = o3d.utility.IntVector(np.zeros(2, dtype=np.int32))
    np.testing.assert_allclose(
        vertex_colors(mesh)[:4], [(1, 0, 0), (0, 1, 0), (1, 1, 0), (0, 0, 1)], atol=1e-6
    )
