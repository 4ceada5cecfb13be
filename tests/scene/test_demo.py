import runpy
import sys
import zipfile
from importlib.resources import files
from pathlib import Path

import numpy as np
import open3d as o3d
import pytest

from o3d_relief.scene.demo import demo_scene

ROOT = Path(__file__).parents[2]
PACKED = files("o3d_relief") / "data" / "demo_scene.npz"


@pytest.fixture(scope="module")
def mesh():
    return demo_scene()


@pytest.fixture(scope="module")
def vertices(mesh):
    return np.array(mesh.vertices)


@pytest.fixture(scope="module")
def faces(mesh):
    return np.array(mesh.triangles)


def test_size_is_as_promised(vertices, faces):
    assert 40_000 <= len(vertices) <= 100_000
    assert np.array_equal(np.unique(faces), np.arange(len(vertices)))
    extent = np.ptp(vertices, axis=0)
    assert 95 < extent[0] < 110
    assert 80 < extent[1] < 100
    assert 60 < extent[2] < 85


def test_is_one_component(mesh):
    _, sizes, _ = mesh.cluster_connected_triangles()
    assert len(sizes) == 1


def test_every_edge_joins_two_opposite_faces(faces):
    half_edges = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    assert len(np.unique(half_edges, axis=0)) == len(half_edges)
    assert np.array_equal(np.unique(half_edges, axis=0), np.unique(half_edges[:, ::-1], axis=0))


def test_every_vertex_has_one_fan(mesh):
    assert mesh.is_edge_manifold(allow_boundary_edges=False)
    assert mesh.is_vertex_manifold()


def test_no_face_is_degenerate_and_the_outside_is_outside(vertices, faces):
    a, b, c = vertices[faces].transpose(1, 0, 2)
    assert np.linalg.norm(np.cross(b - a, c - a), axis=1).min() > 0
    assert np.einsum("ij,ij->", a, np.cross(b, c)) / 6 > 50_000


def test_stands_free_at_several_depths(mesh):
    """Along some lines of sight the viewer passes through three or more bodies one behind the other."""
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(o3d.t.geometry.TriangleMesh.from_legacy(mesh))
    x, y = np.meshgrid(np.linspace(-50, 50, 101), np.linspace(1, 94, 94))
    rays = np.zeros((x.size, 6), dtype=np.float32)
    rays[:, 0], rays[:, 1], rays[:, 2], rays[:, 5] = x.ravel(), y.ravel(), 200, -1
    crossings = scene.count_intersections(o3d.core.Tensor(rays)).numpy()
    assert (crossings >= 6).mean() > 0.03
    front = scene.cast_rays(o3d.core.Tensor(rays))["t_hit"].numpy()
    front = front[np.isfinite(front)]
    assert np.percentile(front, 95) - np.percentile(front, 5) > 40


def test_carries_colours_and_unit_normals(mesh, vertices):
    colours, normals = np.asarray(mesh.vertex_colors), np.asarray(mesh.vertex_normals)
    assert colours.shape == normals.shape == vertices.shape
    assert colours.min() >= 0
    assert colours.max() <= 1
    assert len(np.unique(colours, axis=0)) > 100
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-12)


def test_each_call_returns_a_mesh_of_its_own(mesh, vertices):
    second = demo_scene()
    assert np.array_equal(np.asarray(second.vertices), vertices)
    assert np.array_equal(np.asarray(second.triangles), np.asarray(mesh.triangles))
    assert np.array_equal(np.asarray(second.vertex_colors), np.asarray(mesh.vertex_colors))
    second.translate((1, 2, 3))
    assert np.array_equal(np.asarray(mesh.vertices), vertices)


def test_packed_file_is_small():
    with PACKED.open("rb") as file:
        assert len(file.read()) < 2_000_000


@pytest.mark.slow
def test_script_makes_the_shipped_file(tmp_path, monkeypatch):
    pytest.importorskip("skimage")
    made = tmp_path / "folder" / "scene.npz"
    script = str(ROOT / "data_scripts" / "make_demo_scene.py")
    monkeypatch.setattr(sys, "argv", [script, str(made)])
    runpy.run_path(script, run_name="__main__")
    # The bytes of the arrays: the deflate streams around them differ between builds of zlib.
    with zipfile.ZipFile(made) as new, PACKED.open("rb") as file, zipfile.ZipFile(file) as shipped:
        assert new.namelist() == shipped.namelist()
        for name in shipped.namelist():
            assert new.read(name) == shipped.read(name), name
