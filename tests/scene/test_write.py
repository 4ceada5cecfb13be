"""Writing: what each format keeps, the same bytes twice, and all or nothing."""

import os
import struct
from pathlib import Path

import numpy as np
import open3d as o3d
import pytest
import trimesh

from o3d_relief.errors import FileError, MeshError
from o3d_relief.scene.read import read_mesh
from o3d_relief.scene.write import WRITABLE, check_writable, lost_attributes, write_mesh

OFFSET = np.array([1e6, -2e5, 3.0])


def plain_mesh(seed=0):
    """Return a shaken box far from the origin, with one unused vertex."""
    box = o3d.geometry.TriangleMesh.create_box(1.0, 2.0, 3.0)
    shake = np.random.default_rng(seed).normal(scale=0.1, size=(8, 3))
    vertices = np.vstack([np.asarray(box.vertices) + shake, [[0.1, 0.2, 0.3]]]) + OFFSET
    return o3d.geometry.TriangleMesh(o3d.utility.Vector3dVector(vertices), box.triangles)


def colored_mesh():
    mesh = plain_mesh()
    colors = np.random.default_rng(1).integers(0, 256, (9, 3)) / 255.0
    mesh.vertex_colors = o3d.utility.Vector3dVector(colors)
    mesh.compute_vertex_normals()
    return mesh


def textured_mesh():
    """Return a coloured mesh with three materials in turn: two pictures and one white pixel."""
    mesh = colored_mesh()
    rng = np.random.default_rng(2)
    uvs = rng.random((36, 2))
    uvs[3:6] = uvs[0:3]  # some corners share their coordinates
    mesh.triangle_uvs = o3d.utility.Vector2dVector(uvs)
    pictures = [rng.integers(0, 256, size).astype(np.uint8) for size in ((2, 3, 3), (4, 4, 3))]
    pictures.append(np.full((1, 1, 3), 255, np.uint8))
    mesh.textures = [o3d.geometry.Image(picture) for picture in pictures]
    mesh.triangle_material_ids = o3d.utility.IntVector([0, 1, 2] * 4)
    return mesh


MESHES = {"plain": plain_mesh, "colored": colored_mesh, "textured": textured_mesh}


def corners_of(mesh):
    """Return what a viewer sees: position, colour, texture coordinates of each corner (m, 3, 8)."""
    faces = np.asarray(mesh.triangles)
    uvs = np.asarray(mesh.triangle_uvs).reshape(len(faces), 3, 2)
    return np.concatenate(
        [np.asarray(mesh.vertices)[faces], np.asarray(mesh.vertex_colors)[faces], uvs], axis=2
    )


def pixels_of(mesh, face):
    return np.asarray(mesh.textures[mesh.triangle_material_ids[face]])


def contents(folder):
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


def equal(a, b):
    np.testing.assert_array_equal(np.asarray(a), np.asarray(b))


class TestRoundTrip:
    @pytest.mark.parametrize("ending", [".ply", ".obj"])
    @pytest.mark.parametrize("kind", MESHES)
    def test_exact_in_double_precision(self, tmp_path, kind, ending):
        mesh = MESHES[kind]()
        write_mesh(tmp_path / f"a{ending}", mesh)
        back = read_mesh(tmp_path / f"a{ending}")
        equal(back.vertices, mesh.vertices)
        equal(back.triangles, mesh.triangles)
        equal(back.vertex_normals, mesh.vertex_normals)
        np.testing.assert_allclose(np.asarray(back.vertex_colors), np.asarray(mesh.vertex_colors), atol=1e-6)
        if ending == ".obj":
            equal(back.triangle_uvs, mesh.triangle_uvs)
            equal(back.triangle_material_ids, mesh.triangle_material_ids)
            assert len(back.textures) == len(mesh.textures)
            for mine, theirs in zip(back.textures, mesh.textures, strict=True):
                equal(mine, theirs)

    def test_colors_beyond_8_bits_are_rounded_and_clipped(self, tmp_path):
        mesh = plain_mesh()
        mesh.vertex_colors = o3d.utility.Vector3dVector(np.tile([0.5011, -1.0, 2.0], (9, 1)))
        write_mesh(tmp_path / "a.ply", mesh)
        equal(read_mesh(tmp_path / "a.ply").vertex_colors, np.tile([128 / 255, 0.0, 1.0], (9, 1)))

    def test_stl(self, tmp_path):
        mesh = colored_mesh()
        write_mesh(tmp_path / "a.stl", mesh)
        triangles = np.asarray(mesh.vertices)[np.asarray(mesh.triangles)]
        equal(read_mesh(tmp_path / "a.stl").vertices, triangles.astype(np.float32).reshape(-1, 3))
        again = trimesh.load_mesh(tmp_path / "a.stl", process=False)
        edges = triangles[:, 1:] - triangles[:, :1]
        normals = np.cross(edges[:, 0], edges[:, 1])
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        stored = np.frombuffer((tmp_path / "a.stl").read_bytes(), "<f4,<f4,<f4,(9,)<f4,<u2", offset=84)
        np.testing.assert_allclose(np.stack([stored[f"f{i}"] for i in range(3)], axis=1), normals, atol=1e-6)
        assert len(again.faces) == 12

    def test_stl_of_a_triangle_without_area(self, tmp_path):
        flat = o3d.geometry.TriangleMesh(
            o3d.utility.Vector3dVector(np.eye(3)), o3d.utility.Vector3iVector([[0, 1, 1]])
        )
        write_mesh(tmp_path / "a.stl", flat)
        assert struct.unpack_from("<3f", (tmp_path / "a.stl").read_bytes(), 84) == (0.0, 0.0, 0.0)

    @pytest.mark.parametrize("kind", ["plain", "colored"])
    def test_glb_without_textures_keeps_the_numbers(self, tmp_path, kind):
        mesh = MESHES[kind]()
        write_mesh(tmp_path / "a.glb", mesh)
        back = read_mesh(tmp_path / "a.glb")
        equal(back.vertices, np.asarray(mesh.vertices).astype(np.float32))
        equal(back.triangles, mesh.triangles)
        np.testing.assert_allclose(
            np.asarray(back.vertex_normals)[:8], np.asarray(mesh.vertex_normals)[:8], atol=1e-6
        )
        equal(back.vertex_colors, mesh.vertex_colors)

    def test_glb_with_textures_looks_the_same(self, tmp_path):
        mesh = textured_mesh()
        write_mesh(tmp_path / "a.glb", mesh)
        back = read_mesh(tmp_path / "a.glb")
        order = np.argsort(np.asarray(mesh.triangle_material_ids), kind="stable")
        wanted = corners_of(mesh)[order]
        found = corners_of(back)
        np.testing.assert_allclose(found[..., :3], wanted[..., :3].astype(np.float32))
        np.testing.assert_allclose(found[..., 3:], wanted[..., 3:], atol=1e-6)
        for new, old in enumerate(order.tolist()):
            equal(pixels_of(back, new), pixels_of(mesh, old))

    def test_glb_with_one_texture_and_no_seams_keeps_the_numbers(self, tmp_path):
        mesh = colored_mesh()
        by_vertex = np.random.default_rng(3).random((9, 2))
        faces = np.asarray(mesh.triangles)
        mesh.triangle_uvs = o3d.utility.Vector2dVector(by_vertex[faces].reshape(-1, 2))
        mesh.textures = [o3d.geometry.Image(np.full((2, 2, 3), 9, np.uint8))]  # no material ids: all are 0
        write_mesh(tmp_path / "a.glb", mesh)
        back = read_mesh(tmp_path / "a.glb")
        equal(back.vertices, np.asarray(mesh.vertices).astype(np.float32))
        equal(back.triangles, faces)
        equal(back.textures[0], mesh.textures[0])

    def test_other_programs_read_the_textures_the_same_way_up(self, tmp_path):
        mesh = textured_mesh()
        write_mesh(tmp_path / "a.obj", mesh)
        theirs = o3d.io.read_triangle_mesh(str(tmp_path / "a.obj"))
        order = np.argsort(np.asarray(mesh.triangle_material_ids), kind="stable")  # Open3D sorts by material
        for new, old in enumerate(order[:8].tolist()):
            equal(pixels_of(theirs, new), pixels_of(mesh, old))
        wanted = np.asarray(mesh.triangle_uvs).reshape(-1, 6)[order]
        np.testing.assert_allclose(np.asarray(theirs.triangle_uvs).reshape(-1, 6), wanted, atol=1e-6)
        write_mesh(tmp_path / "a.glb", mesh)
        scene = trimesh.load(tmp_path / "a.glb", force="scene")
        picture = scene.geometry["mesh_0"].visual.material.baseColorTexture
        equal(np.asarray(picture)[::-1], mesh.textures[0])

    def test_pictures_of_other_kinds_become_rgb(self, tmp_path):
        mesh = textured_mesh()
        rng = np.random.default_rng(4)
        grey, clear = (
            rng.integers(0, 256, (2, 2)).astype(np.uint8),
            rng.integers(0, 256, (2, 2, 4)).astype(np.uint8),
        )
        deep = (rng.integers(0, 256, (2, 2)) * 257).astype(np.uint16)
        floats = (rng.integers(0, 256, (2, 2, 3)) / 255).astype(np.float32)
        mesh.textures = [o3d.geometry.Image(picture) for picture in (grey, clear, deep, floats)]
        mesh.triangle_material_ids = o3d.utility.IntVector([0, 1, 2, 3] * 3)
        write_mesh(tmp_path / "a.obj", mesh)
        back = read_mesh(tmp_path / "a.obj")
        equal(back.textures[0], np.repeat(grey[:, :, None], 3, axis=2))
        equal(back.textures[1], clear[:, :, :3])
        equal(back.textures[2], np.repeat((deep // 257)[:, :, None], 3, axis=2))
        equal(back.textures[3], np.rint(floats * 255))

    @pytest.mark.parametrize("ids", [[0, 1] * 6, [0, 7] * 6, [0, -1] * 6])
    def test_empty_and_missing_textures_are_white(self, tmp_path, ids):
        mesh = textured_mesh()
        mesh.textures = [mesh.textures[0], o3d.geometry.Image()]
        mesh.triangle_material_ids = o3d.utility.IntVector(ids)
        for ending in (".obj", ".glb"):
            write_mesh(tmp_path / f"a{ending}", mesh)
            back = read_mesh(tmp_path / f"a{ending}")
            assert sorted(np.asarray(texture).shape for texture in back.textures) == [(1, 1, 3), (2, 3, 3)]

    @pytest.mark.parametrize("ending", WRITABLE)
    def test_the_mesh_is_not_touched(self, tmp_path, ending):
        mesh, same = textured_mesh(), textured_mesh()
        write_mesh(tmp_path / f"a{ending}", mesh)
        for name in ("vertices", "triangles", "vertex_colors", "vertex_normals", "triangle_uvs"):
            equal(getattr(mesh, name), getattr(same, name))

    @pytest.mark.parametrize("ending", WRITABLE)
    @pytest.mark.parametrize("kind", MESHES)
    def test_same_bytes_twice(self, tmp_path, kind, ending):
        for folder in ("one", "two"):
            (tmp_path / folder).mkdir()
            write_mesh(tmp_path / folder / f"a{ending}", MESHES[kind]())
        assert contents(tmp_path / "one") == contents(tmp_path / "two")


class TestLosses:
    @pytest.mark.parametrize(
        ("name", "kind", "lost"),
        [
            ("a.ply", "colored", []),
            ("a.ply", "textured", ["textures"]),
            ("a.STL", "colored", ["colours"]),
            ("a.stl", "textured", ["colours", "textures"]),
            ("a.stl", "plain", []),
            ("a.obj", "textured", []),
            ("a.glb", "textured", []),
        ],
    )
    def test_said_in_one_sentence(self, name, kind, lost):
        what, form = " and no ".join(lost), name[2:].upper()
        wanted = f"{name} will have no {what}: {form} cannot hold them; OBJ and GLB can"
        assert lost_attributes(name, MESHES[kind]()) == ([wanted] if lost else [])

    @pytest.mark.parametrize("ending", WRITABLE)
    def test_what_is_not_finite_is_mended(self, tmp_path, ending):
        mesh = textured_mesh()
        np.asarray(mesh.vertex_colors)[3] = np.nan
        np.asarray(mesh.triangle_uvs)[5] = [np.inf, 1e300]
        np.asarray(mesh.vertex_normals)[2] = np.nan
        write_mesh(tmp_path / f"a{ending}", mesh)
        back = read_mesh(tmp_path / f"a{ending}")
        for values in (back.vertex_colors, back.triangle_uvs, back.vertex_normals):
            assert np.isfinite(np.asarray(values)).all()
        if ending == ".obj":
            equal(back.vertex_colors[3], [1, 1, 1])
            equal(back.triangle_uvs[5], [0.5, 0.5])
            assert not back.has_vertex_normals()


class TestPlaces:
    def test_names_beside_an_obj(self, tmp_path):
        write_mesh(tmp_path / "a b.é.OBJ", textured_mesh())
        write_mesh(tmp_path / "c.obj", textured_mesh())
        names = sorted(contents(tmp_path))
        assert names[0] == "a b.é.OBJ"
        assert names[4:] == ["c.mtl", "c.obj", "c_0.png", "c_1.png"]
        # Many readers end a name at its first space.
        assert all(name.startswith("a_b.é_") for name in names[1:4])
        assert [name[-4:] for name in names[1:4]] == [".mtl", ".png", ".png"]
        assert len(read_mesh(tmp_path / "a b.é.OBJ").textures) == 3

    def test_names_without_spaces_belong_to_one_file_only(self, tmp_path):
        for name in ("a b.obj", "a_b.obj", "a  b.obj", "a\tb.obj"):
            write_mesh(tmp_path / name, textured_mesh())
        assert len(contents(tmp_path)) == 4 * 4

    @pytest.mark.parametrize("ending", WRITABLE)
    def test_plain_meshes_make_one_file_with_common_rights(self, tmp_path, ending):
        write_mesh(str(tmp_path / f"a{ending}"), plain_mesh())
        assert list(contents(tmp_path)) == [f"a{ending}"]
        (tmp_path / "other").write_text("")
        assert (tmp_path / f"a{ending}").stat().st_mode == (tmp_path / "other").stat().st_mode

    def test_replaces(self, tmp_path):
        write_mesh(tmp_path / "a.obj", textured_mesh())
        mesh = textured_mesh()
        mesh.textures = [mesh.textures[1], mesh.textures[0], mesh.textures[2]]
        write_mesh(tmp_path / "a.obj", mesh)
        equal(read_mesh(tmp_path / "a.obj").textures[0], mesh.textures[0])
        assert sorted(contents(tmp_path)) == ["a.mtl", "a.obj", "a_0.png", "a_1.png"]

    def test_relative_name(self, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        write_mesh("a.ply", plain_mesh())
        assert list(contents(tmp_path)) == ["a.ply"]


class TestRefusals:
    @pytest.mark.parametrize("name", ["a.off", "a.gltf", "a.3mf", "a"])
    def test_ending(self, tmp_path, name):
        with pytest.raises(FileError, match=rf"{name} cannot be written: its ending must be one of \.ply"):
            check_writable(tmp_path / name)

    def test_folder_in_its_place(self, tmp_path):
        (tmp_path / "a.ply").mkdir()
        with pytest.raises(FileError, match=r"a\.ply is a folder: give the name of a file"):
            check_writable(tmp_path / "a.ply")

    def test_missing_folder(self, tmp_path):
        with pytest.raises(
            FileError, match=r"a\.ply cannot be written, the folder .*nowhere is missing: make it"
        ):
            write_mesh(tmp_path / "nowhere" / "a.ply", plain_mesh())
        assert contents(tmp_path) == {}

    def test_file_in_place_of_the_folder(self, tmp_path):
        (tmp_path / "file").write_text("x")
        with pytest.raises(FileError, match=r"a\.ply cannot be written, .*file is not a folder"):
            check_writable(tmp_path / "file" / "a.ply")

    def test_read_only_folder(self, tmp_path, monkeypatch):
        monkeypatch.setattr(os, "access", lambda path, mode: Path(path) != tmp_path)
        with pytest.raises(FileError, match=r"a\.ply cannot be written, the folder .* is read-only"):
            check_writable(str(tmp_path / "a.ply"))

    def test_name_too_long(self, tmp_path):
        with pytest.raises(FileError, match="cannot be written: File name too long"):
            write_mesh(tmp_path / (300 * "a" + ".ply"), plain_mesh())
        assert contents(tmp_path) == {}

    def test_fine(self, tmp_path):
        for ending in WRITABLE:
            check_writable(tmp_path / f"a{ending.upper()}")
        assert contents(tmp_path) == {}

    @pytest.mark.parametrize("ending", WRITABLE)
    @pytest.mark.parametrize(
        ("vertices", "faces", "reason"),
        [
            (np.eye(3), np.zeros((0, 3)), "no triangles"),
            (np.zeros((0, 3)), np.zeros((0, 3)), "no triangles"),
            (np.eye(3), [[0, 1, 3]], "triangles whose vertices do not exist"),
            (np.eye(3), [[0, 1, -1]], "triangles whose vertices do not exist"),
            (np.full((3, 3), np.nan), [[0, 1, 2]], "vertices that are not finite"),
        ],
    )
    def test_meshes(self, tmp_path, ending, vertices, faces, reason):
        mesh = o3d.geometry.TriangleMesh(
            o3d.utility.Vector3dVector(vertices),
            o3d.utility.Vector3iVector(np.asarray(faces, dtype=np.int32)),
        )
        with pytest.raises(MeshError, match=rf"a\{ending} is not written: the mesh has {reason}"):
            write_mesh(tmp_path / f"a{ending}", mesh)
        assert contents(tmp_path) == {}

    @pytest.mark.parametrize("ending", [".stl", ".glb"])
    def test_too_large_for_float32(self, tmp_path, ending):
        mesh = plain_mesh()
        mesh.scale(1e40, center=(0, 0, 0))
        with pytest.raises(MeshError, match="too large for this format"):
            write_mesh(tmp_path / f"a{ending}", mesh)
        write_mesh(tmp_path / "a.ply", mesh)


class TestFailures:
    """The folder is left as it was, whatever goes wrong, wherever."""

    @pytest.mark.parametrize("method", ["replace", "write_bytes"])
    @pytest.mark.parametrize("old", [False, True])
    def test_at_every_step(self, tmp_path, monkeypatch, old, method):
        path = tmp_path / "a.obj"
        if old:
            write_mesh(path, plain_mesh(seed=5))
            for name in ("a.mtl", "a_1.png"):
                (tmp_path / name).write_text("precious")
        before = contents(tmp_path)
        working = getattr(Path, method)
        for survived in range(4):
            calls = []

            def fail(self, *arguments, calls=calls, survived=survived):
                calls.append(self)
                if len(calls) == survived + 1:
                    raise OSError(28, "No space left on device")
                return working(self, *arguments)

            with monkeypatch.context() as patch:
                patch.setattr(Path, method, fail)
                with pytest.raises(FileError, match=r"a\.obj cannot be written: No space left on device\."):
                    write_mesh(path, textured_mesh())
            assert contents(tmp_path) == before
        write_mesh(path, textured_mesh())
        assert sorted(contents(tmp_path)) == ["a.mtl", "a.obj", "a_0.png", "a_1.png"]

    def test_interrupted(self, tmp_path, monkeypatch):
        def interrupt(self, target):
            raise KeyboardInterrupt

        monkeypatch.setattr(Path, "replace", interrupt)
        with pytest.raises(KeyboardInterrupt):
            write_mesh(tmp_path / "a.obj", textured_mesh())
        assert contents(tmp_path) == {}

    def test_a_folder_in_place_of_the_materials(self, tmp_path):
        (tmp_path / "a.mtl").mkdir()
        (tmp_path / "a.mtl" / "precious").write_text("x")
        with pytest.raises(FileError, match=r"a\.obj cannot be written: .*a\.mtl is a folder"):
            write_mesh(tmp_path / "a.obj", textured_mesh())
        assert [path.name for path in tmp_path.rglob("*")] == ["a.mtl", "precious"]


@pytest.mark.data
@pytest.mark.parametrize("ending", WRITABLE)
def test_real_textures(data_folder, tmp_path, ending):
    mesh = read_mesh(data_folder / "robot_steampunk_textured.glb")
    write_mesh(tmp_path / f"a{ending}", mesh)
    back = read_mesh(tmp_path / f"a{ending}")
    places = np.asarray(mesh.vertices)[np.asarray(mesh.triangles)]
    extent = np.ptp(places.reshape(-1, 3), axis=0).max()
    found = np.asarray(back.vertices)[np.asarray(back.triangles)]
    tolerance = extent * (1e-9 if ending in (".ply", ".obj") else 1e-6)
    if ending != ".glb":
        np.testing.assert_allclose(found, places, atol=tolerance)
    assert len(found) == len(places)
    assert len(back.textures) == (3 if ending in (".obj", ".glb") else 0)
