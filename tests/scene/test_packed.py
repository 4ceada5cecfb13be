import copy
import pickle

import numpy as np
import open3d as o3d
import pytest

from o3d_relief.scene.packed import PackedMesh
from shapes import sphere, to_mesh

NAMES = ("vertices", "triangles", "vertex_normals", "vertex_colors", "triangle_normals", "triangle_uvs")


def _dressed():
    mesh = to_mesh(sphere(6))
    mesh.compute_vertex_normals()  # those of the triangles, too
    rng = np.random.default_rng(0)
    count = len(mesh.triangles)
    mesh.vertex_colors = o3d.utility.Vector3dVector(rng.random((len(mesh.vertices), 3)))
    mesh.triangle_uvs = o3d.utility.Vector2dVector(rng.random((3 * count, 2)))
    mesh.triangle_material_ids = o3d.utility.IntVector((np.arange(count) % 4).astype(np.int32))
    mesh.textures = [
        o3d.geometry.Image(rng.integers(0, 255, (4, 3, 3), dtype=np.uint8)),
        o3d.geometry.Image(),
        o3d.geometry.Image(rng.random((2, 5)).astype(np.float32)),
        o3d.geometry.Image(rng.integers(0, 65535, (2, 2), dtype=np.uint16)),
    ]
    return mesh


@pytest.mark.parametrize("mesh", [_dressed(), to_mesh(sphere(6)), o3d.geometry.TriangleMesh()])
@pytest.mark.parametrize("through", [lambda p: pickle.loads(pickle.dumps(p)), copy.deepcopy, lambda p: p])
def test_nothing_of_a_mesh_is_lost(mesh, through):
    again = through(PackedMesh.of(mesh)).mesh()
    for name in (*NAMES, "triangle_material_ids"):
        assert np.array_equal(getattr(again, name), getattr(mesh, name))
    assert len(again.textures) == len(mesh.textures)
    for one, other in zip(again.textures, mesh.textures, strict=True):
        assert one.is_empty() == other.is_empty()
        if not other.is_empty():
            assert np.asarray(one).dtype == np.asarray(other).dtype
            assert np.array_equal(one, other)


def test_it_is_a_copy():
    mesh = to_mesh(sphere(6))
    before = np.array(mesh.vertices)
    packed = PackedMesh.of(mesh)
    mesh.scale(2.0, (0.0, 0.0, 0.0))
    packed.mesh().scale(3.0, (0.0, 0.0, 0.0))
    assert np.array_equal(packed.mesh().vertices, before)
