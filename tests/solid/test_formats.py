import hashlib
import xml.etree.ElementTree as ET
import zipfile
from io import BytesIO

import numpy as np
import pytest
import trimesh

from o3d_relief.errors import FileError
from o3d_relief.scene.read import read_mesh
from o3d_relief.solid.body import PLATE_COLOR
from o3d_relief.solid.formats import SOLID_WRITABLE, write_solid, write_solids
from o3d_relief.solid.threemf import encode_3mf
from slabs import ball_on_slab, slab

CORE = "{http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"
MATERIAL = "{http://schemas.microsoft.com/3dmanufacturing/material/2015/02}"


def _model(path):
    with zipfile.ZipFile(path) as archive:
        assert archive.testzip() is None
        return ET.fromstring(archive.read("3D/3dmodel.model"))


def _numbers(parent, tag, *names):
    return np.array([[float(item.get(name)) for name in names] for item in parent.iter(tag)])


@pytest.mark.parametrize("ending", ["stl", "ply", "obj", "glb"])
@pytest.mark.parametrize("colored", [False, True])
def test_what_is_written_is_watertight_and_of_the_same_size(tmp_path, ending, colored):
    solid = ball_on_slab(colored=colored)
    path = tmp_path / f"piece.{ending}"
    write_solid(path, solid)
    read = trimesh.load(path, force="mesh")
    read.merge_vertices(merge_tex=True, merge_norm=True)  # seams of colour; trimesh keeps them in GLB
    metre = 1000.0 if ending == "glb" else 1.0
    assert read.is_watertight
    assert read.is_winding_consistent
    assert read.volume * metre**3 == pytest.approx(solid.volume, rel=1e-6)
    np.testing.assert_allclose(read.extents * metre, solid.size, rtol=1e-6)


@pytest.mark.parametrize("colored", [False, True])
def test_3mf_holds_the_solid_in_millimetres(tmp_path, colored):
    solid = ball_on_slab(colored=colored)
    path = tmp_path / "piece.3mf"
    write_solid(path, solid)
    model = _model(path)
    assert model.get("unit") == "millimeter"
    vertices = _numbers(model, f"{CORE}vertex", "x", "y", "z")
    np.testing.assert_array_equal(vertices.astype(np.float32), solid.vertices.astype(np.float32))
    faces = _numbers(model, f"{CORE}triangle", "v1", "v2", "v3")
    np.testing.assert_array_equal(faces, solid.faces)
    (item,) = model.iter(f"{CORE}item")
    placed = np.array(item.get("transform").split(), dtype=float).reshape(4, 3)
    np.testing.assert_array_equal(placed[:3], np.eye(3))
    np.testing.assert_allclose(vertices.min(axis=0) + placed[3], 0.0, atol=1e-5)


def test_3mf_keeps_the_colour_of_every_corner(tmp_path):
    solid = ball_on_slab(colored=True)
    path = tmp_path / "piece.3mf"
    write_solid(path, solid)
    model = _model(path)
    palette = [item.get("color") for item in model.iter(f"{MATERIAL}color")]
    colors = np.array([[int(text[i : i + 2], 16) for i in (1, 3, 5)] for text in palette])
    corners = _numbers(model, f"{CORE}triangle", "p1", "p2", "p3").astype(int)
    np.testing.assert_allclose(colors[corners] / 255.0, solid.corner_colors(), atol=0.5 / 255 + 1e-9)
    flat = np.ptp(colors[corners], axis=1).max(axis=1) == 0
    assert flat[solid.is_plate].all()  # no colour of the ball bleeds into the plate
    assert not flat[~solid.is_plate].all()


@pytest.mark.parametrize("colored", [False, True])
def test_lib3mf_reads_it_without_a_warning(tmp_path, colored):
    lib3mf = pytest.importorskip("lib3mf")
    solid = ball_on_slab(colored=colored)
    path = tmp_path / "piece.3mf"
    write_solid(path, solid)
    model = lib3mf.get_wrapper().CreateModel()
    reader = model.QueryReader("3mf")
    reader.SetStrictModeActive(True)
    reader.ReadFromFile(str(path))
    assert reader.GetWarningCount() == 0
    assert model.GetUnit() == lib3mf.Lib3MF.ModelUnit.MilliMeter
    meshes = model.GetMeshObjects()
    assert meshes.Count() == 1
    assert meshes.MoveNext()
    mesh = meshes.GetCurrentMeshObject()
    assert mesh.IsManifoldAndOriented()
    assert (mesh.GetVertexCount(), mesh.GetTriangleCount()) == (len(solid.vertices), len(solid.faces))
    assert model.GetColorGroups().Count() == (1 if colored else 0)


def test_several_solids_make_several_objects(tmp_path):
    path = tmp_path / "two.3mf"
    path.write_bytes(encode_3mf({'a < b & "c"': slab(), "d": ball_on_slab(colored=True)}))
    model = _model(path)
    objects = {item.get("id"): item.get("name") for item in model.iter(f"{CORE}object")}
    assert list(objects.values()) == ['a < b & "c"', "d"]
    assert [item.get("objectid") for item in model.iter(f"{CORE}item")] == list(objects)


@pytest.mark.parametrize("ending", ["ply", "obj", "glb"])
def test_colours_survive_and_do_not_bleed(tmp_path, ending):
    solid = ball_on_slab(colored=True)
    path = tmp_path / f"piece.{ending}"
    write_solid(path, solid)
    mesh = read_mesh(path)
    colors = np.asarray(mesh.vertex_colors)[np.asarray(mesh.triangles)]
    np.testing.assert_allclose(colors, solid.corner_colors(), atol=0.5 / 255 + 1e-6)
    np.testing.assert_allclose(colors[solid.is_plate] - PLATE_COLOR, 0.0, atol=0.5 / 255 + 1e-6)


@pytest.mark.parametrize("ending", SOLID_WRITABLE)
def test_the_same_solid_gives_the_same_bytes(tmp_path, ending):
    sums = set()
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        path = tmp_path / name / f"piece{ending}"
        write_solid(path, ball_on_slab(colored=True))
        sums.add(hashlib.sha256(path.read_bytes()).hexdigest())
    assert len(sums) == 1


def test_zip_has_no_time_stamps():
    with zipfile.ZipFile(BytesIO(encode_3mf({"slab": slab()}))) as archive:
        assert {info.date_time for info in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}


def test_other_endings_are_refused(tmp_path):
    with pytest.raises(FileError, match=r"must be one of \.3mf"):
        write_solid(tmp_path / "piece.step", slab())


def test_all_files_or_none(tmp_path):
    (tmp_path / "two.stl").mkdir()
    with pytest.raises(FileError, match="cannot be written"):
        write_solids(tmp_path / "one.stl", {"two.stl": slab(), "one.stl": slab()})
    assert sorted(item.name for item in tmp_path.iterdir()) == ["two.stl"]
