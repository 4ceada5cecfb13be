import numpy as np
import open3d as o3d
import pytest

import o3d_relief as rel
from o3d_relief.scene.convert import arrays_mesh, check_mesh, mesh_arrays
from shapes import bust, sphere, to_mesh


def test_arrays_go_out_and_come_back():
    vertices, faces = sphere(6)
    back, indices = mesh_arrays(arrays_mesh(vertices, faces))
    assert np.array_equal(back, vertices)
    assert np.array_equal(indices, faces)


def test_what_is_taken_out_is_a_copy():
    mesh = to_mesh(sphere(6))
    before = np.array(mesh.vertices)
    vertices, faces = mesh_arrays(mesh)
    vertices += 1.0
    faces[:] = 0
    assert np.array_equal(mesh.vertices, before)
    assert np.asarray(mesh.triangles).any()


@pytest.mark.parametrize(
    ("wrong", "sentence"),
    [
        (None, "Got a builtins.NoneType instead.$"),
        ("x.ply", "Got a builtins.str instead: read the file with read_mesh"),
        (o3d.t.geometry.TriangleMesh(), r"instead: take what its to_legacy\(\) returns"),
        (o3d.t.geometry.PointCloud(), r"instead: take what its to_legacy\(\) returns"),
        (o3d.geometry.PointCloud(), "geometry.PointCloud instead: make a mesh of it with mesh_from_points"),
    ],
)
def test_what_is_no_mesh_is_named_and_how_to_make_one(tmp_path, wrong, sentence):
    with pytest.raises(
        rel.MeshError, match=f"The thing must be an open3d.geometry.TriangleMesh. .*{sentence}"
    ):
        check_mesh("The thing", wrong)
    with pytest.raises(rel.MeshError, match=sentence):
        rel.write_mesh(tmp_path / "x.ply", wrong)
    with pytest.raises(rel.MeshError, match=sentence):
        rel.ReliefEditor(wrong)
    with pytest.raises(rel.MeshError, match=sentence):
        rel.render(wrong)
    assert list(tmp_path.iterdir()) == []


def test_a_relief_is_not_taken_for_its_mesh(tmp_path):
    relief = rel.make_relief(to_mesh(bust(8)), rel.ReliefParams(k=3))
    with pytest.raises(rel.MeshError, match="Relief instead: take its mesh"):
        rel.write_mesh(tmp_path / "x.ply", relief)
    with pytest.raises(rel.ParameterError, match="relief must be a Relief, as make_relief returns"):
        rel.make_solid(relief.mesh)
