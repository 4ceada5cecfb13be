"""Reading: every format against hand-written files and files that trimesh wrote."""

import csv
import json
import os
import struct

import numpy as np
import pytest
import trimesh
from PIL import Image
from trimesh.visual import TextureVisuals
from trimesh.visual.material import PBRMaterial

from o3d_relief.errors import FileError, MeshError
from o3d_relief.scene.arrays import to_open3d
from o3d_relief.scene.polygons import fan, strips
from o3d_relief.scene.read import READABLE, left_out, read_arrays, read_mesh

CORNERS = np.array(
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [7, 7, 7]], dtype=float
)  # the last one is unused
PLY_HEADER = "ply\nformat {} 1.0\ncomment made here\nelement vertex 5\n"
PLY_HEADER += "".join(f"property double {axis}\n" for axis in "xyz")
PLY_FACES = "element face 2\nproperty list uchar int vertex_indices\nend_header\n"


def _mesh_and_notes(path):
    arrays = read_arrays(path)
    return to_open3d(arrays), left_out(path, arrays)


def save(path, content):
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def vertices_of(mesh):
    return np.asarray(mesh.vertices)


def faces_of(mesh):
    return np.asarray(mesh.triangles).tolist()


def ascii_ply(faces="4 0 1 2 3\n3 0 1 4\n"):
    rows = "".join("{} {} {}\n".format(*row) for row in CORNERS)
    return PLY_HEADER.format("ascii") + PLY_FACES + rows + faces


def binary_ply(order, polygons):
    name = {"<": "binary_little_endian", ">": "binary_big_endian"}[order]
    header = PLY_HEADER.format(name) + PLY_FACES.replace("face 2", f"face {len(polygons)}")
    rows = b"".join(bytes([len(p)]) + np.array(p, dtype=f"{order}i4").tobytes() for p in polygons)
    return header.encode() + CORNERS.astype(f"{order}f8").tobytes() + rows


def textured_box(color, factor=None, name="a"):
    box = trimesh.creation.box()
    image = None if color is None else Image.new("RGB", (2, 2), color)
    material = PBRMaterial(name=name, baseColorTexture=image, baseColorFactor=factor)
    uv = np.random.default_rng(0).random((8, 2)).astype(np.float32)
    box.visual = TextureVisuals(uv=None if color is None else uv, material=material)
    return box, uv


class TestPolygons:
    def test_fan_keeps_order_and_skips_what_is_no_polygon(self):
        assert fan(np.array([3, 0, 2, 5])).tolist() == [[0, 1, 2], [5, 6, 7], [5, 7, 8], [5, 8, 9]]

    def test_strips_alternate_and_restart(self):
        corners = np.array([0, 1, 2, 3, 4, -1, 5, 6, 7, 7, 8, -1, 1, 2])
        assert strips(corners).tolist() == [[0, 1, 2], [2, 1, 3], [2, 3, 4], [5, 6, 7]]

    def test_nothing(self):
        assert fan(np.zeros(0, dtype=np.int64)).shape == strips(np.zeros(0, dtype=np.int64)).shape == (0, 3)


class TestPly:
    @pytest.mark.parametrize("order", ["<", ">"])
    @pytest.mark.parametrize("polygons", [[(0, 1, 2), (0, 2, 3)], [(0, 1, 2, 3)], [(0, 1, 2, 3), (0, 1, 4)]])
    def test_binary(self, tmp_path, order, polygons):
        mesh = read_mesh(save(tmp_path / "a.ply", binary_ply(order, polygons)))
        np.testing.assert_array_equal(vertices_of(mesh), CORNERS)
        wanted = [[0, 1, 2], [0, 2, 3]] + (
            [[0, 1, 4]] if len(polygons[-1]) == 3 and polygons[-1][1] == 1 else []
        )
        assert faces_of(mesh) == wanted

    def test_ascii(self, tmp_path):
        mesh = read_mesh(save(tmp_path / "a.ply", ascii_ply()))
        np.testing.assert_array_equal(vertices_of(mesh), CORNERS)
        assert faces_of(mesh) == [[0, 1, 2], [0, 2, 3], [0, 1, 4]]
        assert not mesh.has_vertex_colors()
        assert not mesh.has_vertex_normals()
        assert not mesh.has_triangle_uvs()

    def test_windows_line_ends(self, tmp_path):
        mesh = read_mesh(save(tmp_path / "a.PLY", ascii_ply().replace("\n", "\r\n")))
        assert len(mesh.triangles) == 3

    @pytest.mark.parametrize(("kind", "full"), [("uchar", 255), ("ushort", 65535), ("float", 1)])
    def test_colors_normals_and_corner_uvs(self, tmp_path, kind, full):
        names = "".join(f"property {kind} {name}\n" for name in ("red", "green", "blue"))
        normals = "".join(f"property float {name}\n" for name in ("nx", "ny", "nz"))
        face = "element face 1\nproperty list uchar int vertex_index\nproperty list uchar float texcoord\n"
        header = PLY_HEADER.format("ascii").replace("comment made here", "comment TextureFile a b.png")
        rows = "".join("{} {} {} 0 0 1 0 {} 0\n".format(*row, full) for row in CORNERS)
        text = header + normals + names + face + "end_header\n" + rows + "4 0 1 2 3 8 0 0 .5 0 .5 .5 0 .5\n"
        Image.new("RGB", (1, 2), "red").save(tmp_path / "a b.png")
        mesh = read_mesh(save(tmp_path / "a.ply", text))
        np.testing.assert_array_equal(np.asarray(mesh.vertex_colors), np.tile([0.0, 1.0, 0.0], (5, 1)))
        np.testing.assert_array_equal(np.asarray(mesh.vertex_normals), np.tile([0.0, 0.0, 1.0], (5, 1)))
        uvs = [[0, 0], [0.5, 0], [0.5, 0.5], [0, 0], [0.5, 0.5], [0, 0.5]]
        np.testing.assert_array_equal(np.asarray(mesh.triangle_uvs), uvs)
        assert np.asarray(mesh.textures[0]).tolist() == [[[255, 0, 0]]] * 2

    def test_uvs_of_vertices(self, tmp_path):
        header = PLY_HEADER.format("ascii") + "property float s\nproperty float t\n" + PLY_FACES
        rows = "".join(f"{x} {y} {z} {x / 8} {y / 8}\n" for x, y, z in CORNERS)
        mesh = read_mesh(save(tmp_path / "a.ply", header + rows + "3 0 1 2\n3 0 2 3\n"))
        wanted = CORNERS[np.asarray(mesh.triangles)].reshape(-1, 3)[:, :2] / 8
        np.testing.assert_array_equal(np.asarray(mesh.triangle_uvs), wanted)

    def test_strips(self, tmp_path):
        text = ascii_ply().replace("element face 2", "element tristrips 1").replace("uchar int", "int int")
        text = text[: text.index("4 0 1")] + "7 0 1 3 2 -1 0 1\n"
        assert faces_of(read_mesh(save(tmp_path / "a.ply", text))) == [[0, 1, 3], [3, 1, 2]]

    @pytest.mark.parametrize("order", ["ascii", "binary_little_endian", "binary_big_endian"])
    @pytest.mark.parametrize(
        ("kind", "index"), [("short", "ushort"), ("int16", "short"), ("char", "uint8"), ("float", "double")]
    )
    def test_small_types_and_indices_as_floats(self, tmp_path, order, kind, index):
        types = {"short": "i2", "int16": "i2", "char": "i1", "float": "f4"}
        types |= {"ushort": "u2", "uint8": "u1", "double": "f8"}
        header = PLY_HEADER.replace("double", kind).format(order) + PLY_FACES.replace("int", index, 1)
        header = header.replace("vertex_uint8dices", "vertex_indices")
        polygons = [[0, 1, 2, 3], [0, 1, 4]]
        if order == "ascii":
            rows = "".join("{:g} {:g} {:g}\n".format(*row) for row in CORNERS)
            body = (rows + "".join(f"{len(p)} {' '.join(map(str, p))}\n" for p in polygons)).encode()
        else:
            sign = "<" if "little" in order else ">"
            rows = CORNERS.astype(sign + types[kind]).tobytes()
            body = rows + b"".join(
                bytes([len(p)]) + np.array(p).astype(sign + types[index]).tobytes() for p in polygons
            )
        mesh = read_mesh(save(tmp_path / "a.ply", header.encode() + body))
        np.testing.assert_array_equal(vertices_of(mesh), CORNERS)
        assert faces_of(mesh) == [[0, 1, 2], [0, 2, 3], [0, 1, 4]]

    def test_an_index_that_is_no_number(self, tmp_path):
        text = ascii_ply("4 0 1 nan 3\n3 0 1 4\n").replace("uchar int", "uchar float")
        with pytest.raises(FileError, match="it has an index that is not a number"):
            read_mesh(save(tmp_path / "a.ply", text))

    def test_a_signalling_nan_is_read_without_a_warning(self, tmp_path):
        data = binary_ply("<", [(0, 1, 2)]).replace(b"double", b"float ")
        start = data.index(b"end_header\n") + 11
        floats = CORNERS.astype("<f4").view("<u4")
        floats[4, 0] = 0x7F800001
        mesh = read_mesh(save(tmp_path / "a.ply", data[:start] + floats.tobytes() + data[start + 120 :]))
        assert np.isnan(vertices_of(mesh)[4, 0])

    def test_a_texture_without_a_name_is_a_comment(self, tmp_path):
        text = ascii_ply().replace("comment made here", "comment TextureFile")
        assert len(read_mesh(save(tmp_path / "a.ply", text)).triangles) == 3

    def test_missing_texture_is_noted(self, tmp_path):
        header = PLY_HEADER.format("ascii").replace("made here", "TextureFile gone.png")
        header = header.replace("comment made", "comment") + "property float s\nproperty float t\n"
        rows = "".join(f"{x} {y} {z} 0 0\n" for x, y, z in CORNERS)
        path = save(tmp_path / "a.ply", header + PLY_FACES + rows + "3 0 1 2\n3 0 2 3\n")
        assert _mesh_and_notes(path)[1] == [
            f"{path} names gone.png, which cannot be read: what it colours is left plain"
        ]

    def test_not_finite_vertices_are_read(self, tmp_path):
        mesh = read_mesh(save(tmp_path / "a.ply", ascii_ply().replace("7.0 7.0", "nan inf")))
        assert np.isnan(vertices_of(mesh)[4, 0])
        assert np.isposinf(vertices_of(mesh)[4, 1])

    @pytest.mark.parametrize("lost", [1, 3, 4, 5, 12, 60, 140])
    @pytest.mark.parametrize("polygons", [[(0, 1, 2), (0, 2, 3)], [(0, 1, 2, 3), (0, 1, 4)]])
    def test_truncated_binary(self, tmp_path, polygons, lost):
        path = save(tmp_path / "a.ply", binary_ply("<", polygons)[:-lost])
        with pytest.raises(FileError, match=r"a\.ply cannot be read: it ends too early"):
            read_mesh(path)

    @pytest.mark.parametrize("lost", [3, 5, 8, 20, 40])
    def test_truncated_ascii(self, tmp_path, lost):
        with pytest.raises(FileError, match=r"a\.ply cannot be read: it ends too early"):
            read_mesh(save(tmp_path / "a.ply", ascii_ply()[:-lost]))

    @pytest.mark.parametrize(
        ("old", "new", "reason"),
        [
            ("ply\n", "plx\n", "it is not a PLY file"),
            ("end_header", "end_of_header", "its header has a line that no PLY file has, 'end_of_header'"),
            ("end_header\n", "", "its header has a line"),
            ("double x", "double y", "two of one name"),
            ("double x", "double q", "it has no vertices with x, y and z"),
            ("3 0 1 4", "3 0 1 4.5e9", "does not fit its type"),
            ("3 0 1 4", "3 0 one 4", "text where numbers should be"),
            ("3 0 1 4", "3 0 1 5", "a vertex that does not exist"),
            ("3 0 1 4", "3 0 1 -1", "a vertex that does not exist"),
            ("vertex 5", "vertex 99999999999", "it ends too early"),
        ],
    )
    def test_damaged(self, tmp_path, old, new, reason):
        text = ascii_ply()
        assert old in text
        with pytest.raises(FileError, match=rf"a\.ply cannot be read: .*{reason}.*Export it again"):
            read_mesh(save(tmp_path / "a.ply", text.replace(old, new, 1)))

    def test_header_without_end(self, tmp_path):
        with pytest.raises(FileError, match="its header has no end"):
            read_mesh(save(tmp_path / "a.ply", PLY_HEADER.format("ascii")))


QUAD_OBJ = """# a comment
mtllib a.mtl
o thing
v 0 0 0
v 1 0 0  # with a comment
v 1 1 0
v 0 1 0
v 7 7 7
vt 0 0
vt .5 0
vt .5 .5
vt 0 .5
g one
usemtl wood
f 1/1 2/2 3/3 4/4
g two
usemtl red
f -5/-4 2/2 5/1
usemtl wood
f 1//  3// \\
4//
"""
QUAD_MTL = "newmtl wood\nKd 0 0 0\nmap_Kd -s 1 1 1 textures\\wood.png\n\nnewmtl red\nKd 1 0 0.2\n"


class TestObj:
    def test_quads_groups_and_materials(self, tmp_path):
        save(tmp_path / "a.mtl", QUAD_MTL)
        picture = np.arange(12, dtype=np.uint8).reshape(2, 2, 3)
        (tmp_path / "textures").mkdir()
        Image.fromarray(picture).save(tmp_path / "textures" / "wood.png")
        mesh = read_mesh(save(tmp_path / "a.obj", QUAD_OBJ))
        np.testing.assert_array_equal(vertices_of(mesh), CORNERS)
        assert faces_of(mesh) == [[0, 1, 2], [0, 2, 3], [0, 1, 4], [0, 2, 3]]
        assert list(mesh.triangle_material_ids) == [0, 0, 1, 0]
        np.testing.assert_array_equal(np.asarray(mesh.textures[0]), picture[::-1])
        assert np.asarray(mesh.textures[1]).tolist() == [[[255, 0, 51]]]
        table = np.array([[0, 0], [0.5, 0], [0.5, 0.5], [0, 0.5], [0.5, 0.5]])
        index = [0, 1, 2, 0, 2, 3, 0, 1, 0, -1, -1, -1]
        np.testing.assert_array_equal(np.asarray(mesh.triangle_uvs), table[index])
        assert not mesh.has_vertex_colors()

    def test_agrees_with_the_reader_of_open3d(self, tmp_path):
        import open3d as o3d

        Image.fromarray(np.arange(48, dtype=np.uint8).reshape(4, 4, 3)).save(tmp_path / "t.png")
        save(tmp_path / "a.mtl", "newmtl m\nKd 1 1 1\nmap_Kd t.png\n")
        corners = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 0.5 0\nvt 0.5 0.5\nvt 0 0.5\n"
        text = f"mtllib a.mtl\n{corners}usemtl m\nf 1/1 2/2 3/3\nf 1/2 3/3 4/4\n"
        mine, theirs = (
            read(str(save(tmp_path / "a.obj", text))) for read in (read_mesh, o3d.io.read_triangle_mesh)
        )
        np.testing.assert_array_equal(np.asarray(mine.triangle_uvs), np.asarray(theirs.triangle_uvs))
        np.testing.assert_array_equal(np.asarray(mine.textures[0]), np.asarray(theirs.textures[-1]))
        places = [
            vertices_of(mesh)[np.asarray(mesh.triangles)] for mesh in (mine, theirs)
        ]  # Open3D splits seams
        np.testing.assert_array_equal(*places)

    def test_missing_material_library(self, tmp_path, capfd):
        path = save(tmp_path / "a.obj", QUAD_OBJ)
        mesh, notes = _mesh_and_notes(path)
        assert notes == [f"{path} names a.mtl, which cannot be read: what it colours is left plain"]
        assert len(mesh.triangles) == 4
        assert len(mesh.textures) == 0
        assert mesh.has_triangle_uvs()
        assert capfd.readouterr() == ("", "")

    @pytest.mark.parametrize("content", [None, b"no picture", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR"])
    def test_missing_or_broken_texture_leaves_the_colors(self, tmp_path, content, capfd):
        save(tmp_path / "a.mtl", QUAD_MTL)
        if content:
            save(tmp_path / "wood.png", content)
        mesh, notes = _mesh_and_notes(save(tmp_path / "a.obj", QUAD_OBJ))
        assert len(notes) == 1
        assert "names textures\\wood.png, which cannot be read" in notes[0]
        assert [np.asarray(texture).tolist() for texture in mesh.textures] == [
            [[[0, 0, 0]]],
            [[[255, 0, 51]]],
        ]
        assert capfd.readouterr() == ("", "")

    @pytest.mark.parametrize(
        ("line", "there", "missing"),
        [
            ("mtllib a b.mtl", ["a b.mtl"], []),
            ("mtllib a.mtl b.mtl", ["a.mtl", "b.mtl"], []),
            ("mtllib a.mtl b.mtl", ["a.mtl"], ["b.mtl"]),
            ("mtllib", [], []),
        ],
    )
    def test_names_of_material_libraries(self, tmp_path, line, there, missing):
        for name in there:
            save(tmp_path / name, QUAD_MTL.replace("map_Kd", "#"))
        path = save(tmp_path / "c.obj", QUAD_OBJ.replace("mtllib a.mtl", line))
        mesh, notes = _mesh_and_notes(path)
        assert [note.split(" names ")[1].split(",")[0] for note in notes] == missing
        assert len(mesh.textures) == (2 if there else 0)

    def test_one_color_becomes_the_vertex_color(self, tmp_path):
        save(tmp_path / "a.mtl", QUAD_MTL)
        mesh = read_mesh(save(tmp_path / "a.obj", QUAD_OBJ.replace("usemtl wood", "usemtl red")))
        np.testing.assert_array_equal(np.asarray(mesh.vertex_colors), np.tile([1.0, 0.0, 0.2], (5, 1)))
        assert len(mesh.textures) == 0

    @pytest.mark.parametrize("full", [1, 255])
    def test_vertex_colors(self, tmp_path, full):
        text = "".join(f"v {i} {i * i} 0 0 {full} 0\n" for i in range(3)) + "f 1 2 3\n"
        mesh = read_mesh(save(tmp_path / "a.obj", text))
        np.testing.assert_array_equal(np.asarray(mesh.vertex_colors), np.tile([0.0, 1.0, 0.0], (3, 1)))

    def test_normals_of_corners_are_averaged(self, tmp_path):
        text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 1\nvn 0 0 2\nvn 0 2 0\nf 1//1 2//1 3//1\nf 2//2 4//2 3//2\n"
        mesh = read_mesh(save(tmp_path / "a.obj", text))
        half = np.sqrt(0.5)
        wanted = [[0, 0, 1], [0, half, half], [0, half, half], [0, 1, 0]]
        np.testing.assert_allclose(np.asarray(mesh.vertex_normals), wanted, atol=1e-15)

    def test_relative_indices_count_from_where_they_stand(self, tmp_path):
        triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\n"
        assert faces_of(read_mesh(save(tmp_path / "a.obj", 2 * triangle))) == [[0, 1, 2], [3, 4, 5]]

    def test_latin_1(self, tmp_path):
        text = "# caf\xe9\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n".encode("latin-1")
        assert len(read_mesh(save(tmp_path / "a.obj", text)).triangles) == 1

    @pytest.mark.parametrize(
        ("old", "new", "reason"),
        [
            ("f -5/-4 2/2 5/1", "f 1 2 6", "a vertex that does not exist"),
            ("f -5/-4 2/2 5/1", "f 1 2 0", "a vertex that does not exist"),
            ("f -5/-4 2/2 5/1", "f -6 2 3", "a vertex that does not exist"),
            ("f -5/-4 2/2 5/1", "f 1 2", "fewer than three corners"),
            ("f -5/-4 2/2 5/1", "f 1 2 x", "not numbers"),
            ("f -5/-4 2/2 5/1", f"f 1 2 {10**30}", "not numbers"),
            ("v 7 7 7", "v 7 7", "fewer than 3 numbers"),
            ("v 7 7 7", "v 7 7 seven", "text where numbers should be"),
        ],
    )
    def test_damaged(self, tmp_path, old, new, reason):
        assert old in QUAD_OBJ
        with pytest.raises(FileError, match=rf"a\.obj cannot be read: .*{reason}"):
            read_mesh(save(tmp_path / "a.obj", QUAD_OBJ.replace(old, new)))


class TestStl:
    @pytest.mark.parametrize("kind", ["stl", "stl_ascii"])
    def test_triangles(self, tmp_path, kind):
        box = trimesh.creation.box()
        mesh = read_mesh(save(tmp_path / "a.stl", box.export(file_type=kind)))
        np.testing.assert_array_equal(vertices_of(mesh), box.triangles.reshape(-1, 3))
        assert faces_of(mesh) == np.arange(36).reshape(-1, 3).tolist()

    def test_binary_that_begins_like_text(self, tmp_path):
        data = trimesh.creation.box().export(file_type="stl")
        assert len(read_mesh(save(tmp_path / "a.stl", b"solid" + data[5:])).triangles) == 12

    def test_several_solids_of_odd_names(self, tmp_path):
        text = trimesh.creation.box().export(file_type="stl_ascii")
        assert (
            len(
                read_mesh(
                    save(tmp_path / "a.stl", text + text.replace("solid ", "solid vertex facet"))
                ).triangles
            )
            == 24
        )

    @pytest.mark.parametrize("kind", ["stl", "stl_ascii"])
    @pytest.mark.parametrize("lost", [10, 50, 137, 400])
    def test_truncated(self, tmp_path, kind, lost):
        data = trimesh.creation.box().export(file_type=kind)
        with pytest.raises(FileError, match=r"a\.stl cannot be read: it ends too early"):
            read_mesh(save(tmp_path / "a.stl", data[:-lost]))

    def test_too_long(self, tmp_path):
        data = trimesh.creation.box().export(file_type="stl") + bytes(50)
        with pytest.raises(FileError, match=r"a\.stl cannot be read: its length does not fit"):
            read_mesh(save(tmp_path / "a.stl", data))

    def test_text_for_a_number(self, tmp_path):
        text = trimesh.creation.box().export(file_type="stl_ascii")
        with pytest.raises(FileError, match="text where numbers should be"):
            read_mesh(save(tmp_path / "a.stl", text.replace("vertex -0.5", "vertex half", 1)))


QUAD_OFF = "OFF # quads\n\n5 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n7 7 7\n4 0 1 2 3 255 0 0\n3 0 1 4\n"


class TestOff:
    def test_quads(self, tmp_path):
        mesh = read_mesh(save(tmp_path / "a.off", QUAD_OFF))
        np.testing.assert_array_equal(vertices_of(mesh), CORNERS)
        assert faces_of(mesh) == [[0, 1, 2], [0, 2, 3], [0, 1, 4]]

    def test_colors(self, tmp_path):
        text = "COFF 3 1 0\n0 0 0 255 0 51 255\n1 0 0 255 0 51 255\n0 1 0 255 0 51 255\n3 0 1 2\n"
        mesh = read_mesh(save(tmp_path / "a.off", text))
        np.testing.assert_array_equal(np.asarray(mesh.vertex_colors), np.tile([1.0, 0.0, 0.2], (3, 1)))

    @pytest.mark.parametrize(
        ("old", "new", "reason"),
        [
            ("OFF", "OOF", "it is not an OFF file"),
            ("OFF #", "OFF BINARY #", "it does not say how many"),
            ("5 2 0", "5 3 0", "it ends too early"),
            ("3 0 1 4", "3 0 1", "it ends too early"),
            ("3 0 1 4", "3 0 1 5", "a vertex that does not exist"),
            ("3 0 1 4", "3 0 1 x", "text where numbers should be"),
            ("7 7 7", "7 7 x", "text where numbers should be"),
            ("7 7 7", "7 7", "fewer than 3 numbers"),
        ],
    )
    def test_damaged(self, tmp_path, old, new, reason):
        assert old in QUAD_OFF
        with pytest.raises(FileError, match=rf"a\.off cannot be read: .*{reason}"):
            read_mesh(save(tmp_path / "a.off", QUAD_OFF.replace(old, new)))


class TestGlb:
    def test_two_nodes_in_their_places_one_mirrored(self, tmp_path):
        scene = trimesh.Scene()
        box = trimesh.creation.box()
        cone = trimesh.creation.cone(1.0, 2.0, sections=5)
        turn = trimesh.transformations.rotation_matrix(0.7, [1, 2, 3], [4, 5, 6])
        mirror = np.diag([-2.0, 1.0, 1.0, 1.0])
        mirror[:3, 3] = (10, 0, 0)
        scene.add_geometry(box, geom_name="box", node_name="a", transform=turn)
        scene.add_geometry(cone, geom_name="cone", node_name="b", transform=mirror, parent_node_name="a")
        mesh = read_mesh(save(tmp_path / "a.glb", scene.export(file_type="glb")))
        places = [box.vertices @ turn[:3, :3].T + turn[:3, 3]]
        both = turn @ mirror
        places.append(cone.vertices @ both[:3, :3].T + both[:3, 3])
        np.testing.assert_allclose(vertices_of(mesh), np.vstack(places), atol=2e-6)
        whole = trimesh.Trimesh(vertices_of(mesh), np.asarray(mesh.triangles), process=False)
        assert whole.is_winding_consistent
        np.testing.assert_allclose(
            [part.volume for part in whole.split()], [1.0, 2.0 * cone.volume], rtol=1e-5
        )

    def test_one_mesh_shown_twice(self, tmp_path):
        scene = trimesh.Scene()
        box = trimesh.creation.box()
        scene.add_geometry(box, geom_name="box", node_name="a")
        scene.graph.update("b", geometry="box", matrix=trimesh.transformations.translation_matrix([5, 0, 0]))
        mesh = read_mesh(save(tmp_path / "a.glb", scene.export(file_type="glb")))
        np.testing.assert_allclose(np.sort(vertices_of(mesh)[::8, 0]), [-0.5, 4.5])
        assert len(mesh.triangles) == 24

    @pytest.mark.parametrize("kind", ["glb", "gltf"])
    def test_materials(self, tmp_path, kind):
        red, red_uv = textured_box("red")
        half, half_uv = textured_box("blue", factor=[255, 51, 255, 255], name="b")
        plain, _ = textured_box(None, factor=[0, 255, 0, 255], name="c")
        scene = trimesh.Scene({"a": red, "b": half, "c": plain})
        if kind == "glb":
            save(tmp_path / "a.glb", scene.export(file_type="glb"))
        else:
            for name, content in scene.export(file_type="gltf").items():
                save(tmp_path / name.replace("model.gltf", "a.gltf"), content)
        mesh = read_mesh(tmp_path / f"a.{kind}")
        pixels = [np.asarray(texture)[0, 0].tolist() for texture in mesh.textures]
        assert pixels == [[255, 0, 0], [0, 0, 255], [255, 255, 255]]
        assert [np.asarray(texture).shape for texture in mesh.textures] == [(2, 2, 3), (2, 2, 3), (1, 1, 3)]
        assert list(mesh.triangle_material_ids) == 12 * [0] + 12 * [1] + 12 * [2]
        colors = np.repeat([[1, 1, 1], [1, 0.2, 1], [0, 1, 0]], 8, axis=0)
        np.testing.assert_allclose(np.asarray(mesh.vertex_colors), colors, atol=1e-12)
        uvs = np.asarray(mesh.triangle_uvs)
        np.testing.assert_allclose(uvs[:36], red_uv[red.faces.ravel()], atol=1e-6)
        np.testing.assert_allclose(uvs[36:72], half_uv[half.faces.ravel()], atol=1e-6)

    def test_vertex_colors_and_normals(self, tmp_path):
        box = trimesh.creation.box()
        colors = np.random.default_rng(1).integers(0, 256, (8, 4)).astype(np.uint8)
        box.visual.vertex_colors = colors
        turn = trimesh.transformations.rotation_matrix(1.0, [0, 0, 1])
        scene = trimesh.Scene()
        scene.add_geometry(box, transform=turn)
        mesh = read_mesh(
            save(tmp_path / "a.glb", trimesh.exchange.gltf.export_glb(scene, include_normals=True))
        )
        np.testing.assert_array_equal(np.asarray(mesh.vertex_colors), colors[:, :3] / 255)
        turned = box.vertex_normals @ turn[:3, :3].T
        np.testing.assert_allclose(np.asarray(mesh.vertex_normals), turned, atol=1e-6)
        assert len(mesh.textures) == 0

    def test_truncated(self, tmp_path):
        data = textured_box("red")[0].export(file_type="glb")
        for lost in (1, 100, len(data) - 30, len(data) - 10):
            with pytest.raises(FileError, match=r"a\.glb cannot be read: "):
                read_mesh(save(tmp_path / "a.glb", data[:-lost]))

    def test_gltf_with_a_missing_part(self, tmp_path):
        files = trimesh.Scene(trimesh.creation.box()).export(file_type="gltf")
        with pytest.raises(
            FileError, match=r"a\.gltf cannot be read: it is damaged, or a file that it names is missing"
        ):
            read_mesh(save(tmp_path / "a.gltf", files["model.gltf"]))

    def test_gltf_with_a_missing_picture_is_noted(self, tmp_path):
        files = textured_box("red")[0].export(file_type="gltf")
        tree = json.loads(files["model.gltf"])
        tree["images"] = [{"uri": "gone.png"}]
        for name, content in files.items():
            save(tmp_path / name, content)
        path = save(tmp_path / "a.gltf", json.dumps(tree))
        mesh, notes = _mesh_and_notes(path)
        assert notes == [f"{path} names gone.png, which cannot be read: what it colours is left plain"]
        assert len(mesh.triangles) == 12

    @pytest.mark.parametrize(
        ("change", "reason"),
        [
            (
                {"extensionsRequired": ["KHR_draco_mesh_compression"]},
                "it needs the glTF extension KHR_draco_mesh",
            ),
            ({"accessors": [{"sparse": {}}]}, "it has sparse accessors"),
            ({"meshes": 5}, "it is damaged"),
        ],
    )
    def test_what_trimesh_would_read_wrongly(self, tmp_path, change, reason):
        header = {"asset": {"version": "2.0"}, **change}
        with pytest.raises(FileError, match=rf"a\.gltf cannot be read: {reason}"):
            read_mesh(save(tmp_path / "a.gltf", json.dumps(header)))

    def test_whole_number_uvs(self, tmp_path):
        def change(tree):
            primitive = tree["meshes"][0]["primitives"][0]
            tree["accessors"][primitive["attributes"]["TEXCOORD_0"]]["componentType"] = 5123

        data = trimesh.exchange.gltf.export_glb(
            trimesh.Scene(textured_box("red")[0]), tree_postprocessor=change
        )
        with pytest.raises(FileError, match="its texture coordinates are whole numbers"):
            read_mesh(save(tmp_path / "a.glb", data))

    def test_colors_of_one_number(self, tmp_path):
        box = trimesh.creation.box()
        material = PBRMaterial()
        box.visual = TextureVisuals(uv=np.zeros((8, 2)), material=material)
        box.visual.vertex_attributes["color"] = np.full((8, 4), 90, np.uint8)
        tree, rest = glb_tree(box.export(file_type="glb"))
        tree["accessors"][tree["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"]]["type"] = "SCALAR"
        with pytest.raises(FileError, match="it is damaged"):
            read_mesh(save(tmp_path / "a.glb", glb_of(tree, rest)))

    def test_uvs_of_three_numbers(self, tmp_path):
        data = textured_box("red")[0].export(file_type="glb")
        tree, rest = glb_tree(data)
        attributes = tree["meshes"][0]["primitives"][0]["attributes"]
        attributes["TEXCOORD_0"] = attributes["POSITION"]
        with pytest.raises(FileError, match="it is damaged"):
            read_mesh(save(tmp_path / "a.glb", glb_of(tree, rest)))

    def test_index_out_of_range(self, tmp_path):
        data = trimesh.creation.box().export(file_type="glb")
        start = 28 + struct.unpack_from("<I", data, 12)[0]
        broken = data[:start] + struct.pack("<I", 99) + data[start + 4 :]
        with pytest.raises(
            FileError, match=r"a\.glb cannot be read: it has a face with a vertex that does not"
        ):
            read_mesh(save(tmp_path / "a.glb", broken))


def glb_tree(data):
    """Return the header of a GLB file and what follows it."""
    size = struct.unpack_from("<I", data, 12)[0]
    return json.loads(data[20 : 20 + size]), data[20 + size :]


def glb_of(tree, rest):
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    return struct.pack("<4sIII4s", b"glTF", 2, 20 + len(text) + len(rest), len(text), b"JSON") + text + rest


class TestBombs:
    """Small files that would use up the memory, or never end."""

    @pytest.fixture
    def box(self):
        return glb_tree(trimesh.Scene(trimesh.creation.box()).export(file_type="glb"))

    @pytest.mark.parametrize("children", [lambda first: [0], lambda first: [first, first]])
    def test_nodes_in_a_circle_or_doubled_forty_times(self, tmp_path, box, children):
        tree, rest = box
        first = len(tree["nodes"])
        tree["nodes"] += [{"children": children(first + i + 1)} for i in range(40)]
        tree["nodes"] += [{"mesh": 0}]
        tree["nodes"][0].setdefault("children", []).append(first)
        assert len(read_mesh(save(tmp_path / "a.glb", glb_of(tree, rest))).triangles) <= 24

    def test_one_mesh_shown_very_often(self, tmp_path, box, monkeypatch):
        tree, rest = box
        first = len(tree["nodes"])
        tree["nodes"] += [{"mesh": 0} for _ in range(999)]
        tree["scenes"][0]["nodes"] += range(first, first + 999)
        path = save(tmp_path / "a.glb", glb_of(tree, rest))
        assert len(read_mesh(path).triangles) == 12_000
        monkeypatch.setattr("o3d_relief.scene.gltf.memory_for", lambda triangles: triangles < 12_000)
        with pytest.raises(
            FileError, match=r"its nodes show 12,000 triangles, more than there is memory for"
        ):
            read_mesh(path)

    @pytest.mark.parametrize("accessor", [0, 1])
    def test_geometry_without_data(self, tmp_path, box, accessor):
        tree, rest = box
        del tree["accessors"][accessor]["bufferView"]
        tree["accessors"][accessor]["count"] = 2**31
        with pytest.raises(FileError, match="it has geometry without data, save it without compression"):
            read_mesh(save(tmp_path / "a.glb", glb_of(tree, rest)))

    @pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="devices and pipes of POSIX")
    def test_devices_and_pipes(self, tmp_path):
        os.mkfifo(tmp_path / "a.ply")
        with pytest.raises(FileError, match=r"a\.ply cannot be read: it is a device or a pipe\."):
            read_mesh(tmp_path / "a.ply")
        path = save(tmp_path / "a.obj", QUAD_OBJ.replace("a.mtl", "/dev/zero"))
        assert "names /dev/zero, which cannot be read" in _mesh_and_notes(path)[1][0]
        files = trimesh.Scene(trimesh.creation.box()).export(file_type="gltf")
        tree = json.loads(files["model.gltf"])
        tree["buffers"][0]["uri"] = "/dev/zero"
        with pytest.raises(FileError, match="damaged, or a file that it names is missing"):
            read_mesh(save(tmp_path / "a.gltf", json.dumps(tree)))

    def test_a_texture_too_large_for_the_memory(self, tmp_path, monkeypatch):
        save(tmp_path / "a.mtl", QUAD_MTL)
        save(tmp_path / "wood.png", bytes(10_000))
        path = save(tmp_path / "a.obj", QUAD_OBJ)
        monkeypatch.setattr("o3d_relief.limits.available_memory", lambda: 9_000)
        assert "wood.png, which cannot be read" in _mesh_and_notes(path)[1][0]

    def test_names_in_a_gltf_file_may_be_escaped(self, tmp_path):
        files = trimesh.Scene(trimesh.creation.box()).export(file_type="gltf")
        tree = json.loads(files.pop("model.gltf"))
        for buffer in tree["buffers"]:
            save(tmp_path / f"a {buffer['uri']}", files[buffer["uri"]])
            buffer["uri"] = f"a%20{buffer['uri']}"
        assert len(read_mesh(save(tmp_path / "a.gltf", json.dumps(tree))).triangles) == 12


class TestRefusals:
    def test_missing(self, tmp_path):
        with pytest.raises(FileError, match=r"nothing\.ply does not exist: check its name"):
            read_mesh(tmp_path / "nothing.ply")

    def test_folder(self, tmp_path):
        with pytest.raises(FileError, match="is a folder: give the name of a file"):
            read_mesh(str(tmp_path))

    def test_unknown_ending(self, tmp_path):
        with pytest.raises(
            FileError, match=r"a\.step cannot be read: its ending must be one of \.ply, \.obj"
        ):
            read_mesh(save(tmp_path / "a.step", "x"))

    def test_unreadable(self, tmp_path, monkeypatch):
        def refuse(self):
            raise PermissionError(13, "Permission denied")

        path = save(tmp_path / "a.ply", ascii_ply())
        monkeypatch.setattr(type(path), "read_bytes", refuse)
        with pytest.raises(FileError, match=r"a\.ply cannot be read: Permission denied\. Check the file"):
            read_mesh(path)

    def test_name_too_long(self, tmp_path):
        with pytest.raises(FileError, match="a\\.ply"):
            read_mesh(tmp_path / (300 * "a" + "a.ply"))

    @pytest.mark.parametrize("ending", READABLE)
    def test_empty(self, tmp_path, ending):
        with pytest.raises(FileError, match=rf"a\{ending} is empty"):
            read_mesh(save(tmp_path / f"a{ending}", b""))

    @pytest.mark.parametrize("ending", sorted({*READABLE} - {".obj"}))
    @pytest.mark.parametrize("content", [b"hello\n", bytes(range(256)), b"\0" * 83, b"{}", b"\xff\xfe[1]"])
    def test_rubbish(self, tmp_path, ending, content):
        with pytest.raises((FileError, MeshError), match=rf"a\{ending} "):
            read_mesh(save(tmp_path / f"a{ending}", content))

    @pytest.mark.parametrize("content", [b"hello\n", bytes(range(256))])
    def test_rubbish_obj_has_no_triangles(self, tmp_path, content):
        with pytest.raises(MeshError, match=r"a\.obj has no triangles, nothing in it"):
            read_mesh(save(tmp_path / "a.obj", content))

    @pytest.mark.parametrize(
        ("name", "content"),
        [
            ("a.ply", PLY_HEADER.format("ascii") + "end_header\n" + 5 * "0 0 0\n"),
            ("a.ply", ascii_ply("2 0 1\n0\n")),
            ("a.obj", 5 * "v 0 0 0\n"),
            ("a.off", "OFF\n5 0 0\n" + 5 * "0 0 0\n"),
        ],
    )
    def test_point_cloud(self, tmp_path, name, content):
        with pytest.raises(
            MeshError, match="has no triangles, only 5 points: read this cloud with read_points"
        ):
            read_mesh(save(tmp_path / name, content))

    @pytest.mark.parametrize("content", [bytes(84), b"solid nothing\nendsolid nothing\n"])
    def test_stl_without_triangles(self, tmp_path, content):
        with pytest.raises(MeshError, match=r"a\.stl has no triangles, nothing in it"):
            read_mesh(save(tmp_path / "a.stl", content))


@pytest.mark.data
def test_real_files(data_folder):
    with (data_folder / "MANIFEST.tsv").open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream, delimiter="\t"))
    assert rows
    for row in rows:
        path = data_folder / row["file"]
        if row["faces"] == "0":
            with pytest.raises(
                MeshError, match=f"{row['file']} has no triangles, only {row['vertices']} points"
            ):
                read_mesh(path)
            continue
        mesh = read_mesh(path)
        faces = np.asarray(mesh.triangles)
        assert len(mesh.vertices) == int(row["vertices"]), row["file"]
        if row["faces"].isdecimal():
            assert len(faces) == int(row["faces"]), row["file"]
        assert np.isfinite(vertices_of(mesh)).all()
        assert faces.min() >= 0
        assert faces.max() < len(mesh.vertices)
        words = row["colour_normals"]
        assert mesh.has_vertex_colors() == ("vertex RGB" in words or "material colours" in words), row["file"]
        assert bool(len(mesh.textures)) == ("base-colour textures" in words), row["file"]


@pytest.mark.data
def test_real_strips_are_the_triangles_of_the_same_bust(data_folder):
    strip, plain = (
        read_mesh(data_folder / f"{name}.ply") for name in ("igea_tristrips_original", "bust_igea")
    )
    np.testing.assert_array_equal(vertices_of(strip), vertices_of(plain))

    def turned(mesh):  # each triangle from its smallest vertex on
        faces = np.asarray(mesh.triangles)
        places = (faces.argmin(axis=1)[:, None] + np.arange(3)) % 3
        return np.unique(np.take_along_axis(faces, places, axis=1), axis=0)

    np.testing.assert_array_equal(turned(strip), turned(plain))
