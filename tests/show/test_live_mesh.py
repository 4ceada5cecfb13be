import numpy as np
import open3d as o3d

from o3d_relief.show.live_mesh import DIMMED, LiveMesh
from shapes import bust


def box():
    mesh = o3d.geometry.TriangleMesh.create_box()
    return np.array(mesh.vertices), np.array(mesh.triangles, dtype=np.int64)


def test_a_box_stays_sharp():
    vertices, faces = box()
    live = LiveMesh(vertices, faces)
    normals = np.asarray(live.mesh.vertex_normals)[np.asarray(live.mesh.triangles)]
    corners = vertices[faces]
    own = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    np.testing.assert_allclose(normals, np.repeat(own[:, None], 3, axis=1), atol=1e-9)


def test_a_smooth_surface_is_not_split():
    vertices, faces = bust(60)
    live = LiveMesh(vertices, faces)
    assert len(live.mesh.vertices) < 1.1 * len(vertices)


def test_moved_and_painted_in_place():
    vertices, faces = box()
    live = LiveMesh(vertices, faces)
    mesh, triangles = live.mesh, np.array(live.mesh.triangles)
    flat = vertices * (1.0, 1.0, 0.25)
    colors = np.random.default_rng(0).random((8, 3))
    live.move(flat)
    live.paint(colors)
    assert live.mesh is mesh
    np.testing.assert_array_equal(np.asarray(mesh.triangles), triangles)
    np.testing.assert_array_equal(np.asarray(mesh.vertices)[triangles], flat[faces])
    np.testing.assert_allclose(np.asarray(mesh.vertex_colors)[triangles], DIMMED * colors[faces])


def test_normals_of_ones_own_are_kept():
    vertices, faces = box()
    normals = np.tile([0.0, 0.6, 0.8], (8, 1))
    live = LiveMesh(vertices, faces, normals)
    np.testing.assert_array_equal(np.asarray(live.mesh.vertex_normals), normals)
    assert live.mesh.has_triangle_normals()
