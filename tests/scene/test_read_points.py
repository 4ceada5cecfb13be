"""Point clouds from files, each format against arrays written by hand."""

import struct

import numpy as np
import open3d as o3d
import pytest

from o3d_relief.errors import FileError, MeshError
from o3d_relief.scene.read import READABLE_CLOUDS, read_arrays, read_points

RANDOM = np.random.default_rng(0)
POINTS = RANDOM.normal(size=(70, 3)) * 100.0 + [5e5, 5e6, 100.0]
COLORS = RANDOM.integers(0, 256, (70, 3))
NORMALS = RANDOM.normal(size=(70, 3))
NORMALS /= np.linalg.norm(NORMALS, axis=1, keepdims=True)


def save(path, content):
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def pcd(kind, fields="x y z", sizes="8 8 8", types="F F F", height=1, **others):
    lines = {"VERSION": "0.7", "FIELDS": fields, "SIZE": sizes, "TYPE": types, "WIDTH": str(70 // height)}
    lines |= {"HEIGHT": str(height), "POINTS": "70"} | others | {"DATA": kind}
    return "# .PCD v0.7\n" + "".join(f"{name} {words}\n" for name, words in lines.items() if words)


def text(*columns):
    return "".join(" ".join(f"{value:.17g}" for value in row) + "\n" for row in np.column_stack(columns))


def packed(colors):
    return (colors[:, 0] << 16 | colors[:, 1] << 8 | colors[:, 2]).astype("<u4")


class TestPcd:
    def test_text(self, tmp_path):
        arrays = read_arrays(save(tmp_path / "a.pcd", pcd("ascii") + text(POINTS)))
        assert np.array_equal(arrays.points, POINTS)
        assert arrays.colors is arrays.normals is arrays.sensor is None

    def test_binary_with_everything(self, tmp_path):
        head = pcd(
            "binary", "x y z rgb normal_x normal_y normal_z _", "8 8 8 4 8 8 8 1", "F F F U F F F U",
            COUNT="1 1 1 1 1 1 1 3",
        )  # fmt: skip
        rows = np.zeros(70, dtype="<f8,<f8,<f8,<u4,<f8,<f8,<f8,3u1")
        for place, column in enumerate([*POINTS.T, packed(COLORS), *NORMALS.T]):
            rows[f"f{place}"] = column
        arrays = read_arrays(save(tmp_path / "a.pcd", head.encode() + rows.tobytes()))
        assert np.array_equal(arrays.points, POINTS)
        assert np.array_equal(arrays.normals, NORMALS)
        np.testing.assert_allclose(arrays.colors, COLORS / 255)

    def test_every_kind_of_nan(self, tmp_path):
        rows = np.ones(70, dtype="<f4,<f4,<f4,<f4,<f4,<f4")
        rows.view("<u4")[:12] = 0x7F800001  # a signalling one, in two points and their normals
        head = pcd("binary", "x y z normal_x normal_y normal_z", "4 4 4 4 4 4", "F F F F F F")
        arrays = read_arrays(save(tmp_path / "a.pcd", head.encode() + rows.tobytes()))
        assert np.isnan(arrays.points[:2]).all()
        assert np.isnan(arrays.normals[:2]).all()
        assert (arrays.points[2:] == 1.0).all()

    def test_colors_as_the_bits_of_a_float(self, tmp_path):
        head = pcd("ascii", "x y z rgb", "4 4 4 4", "F F F F")
        floats = packed(COLORS).view("<f4").astype(float)
        arrays = read_arrays(save(tmp_path / "a.pcd", head + text(POINTS, floats)))
        np.testing.assert_allclose(arrays.colors, COLORS / 255)

    @pytest.mark.parametrize("repeated", [False, True])
    @pytest.mark.parametrize("kind", ["ascii", "binary", "compressed"])
    def test_what_open3d_writes(self, tmp_path, kind, repeated):
        points = np.round(POINTS) if not repeated else np.tile(np.float32(POINTS[:3]), (200, 1))
        cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points.astype(float)))
        cloud.normals = o3d.utility.Vector3dVector(np.tile([0.0, 0.6, 0.8], (len(points), 1)))
        path = tmp_path / "a.pcd"
        words = {"write_ascii": kind == "ascii", "compressed": kind == "compressed"}
        assert o3d.io.write_point_cloud(str(path), cloud, **words)
        again = o3d.io.read_point_cloud(str(path))
        mine = read_points(path)
        assert (b"binary_compressed" in path.read_bytes()) == (kind == "compressed")
        np.testing.assert_allclose(np.asarray(mine.points), np.asarray(again.points), rtol=1e-6)
        np.testing.assert_allclose(np.asarray(mine.normals), np.asarray(again.normals), atol=1e-6)

    def test_organised_clouds_tell_their_sensor(self, tmp_path):
        head = pcd("ascii", height=7, VIEWPOINT="1 2 -3.5 1 0 0 0")
        assert read_arrays(save(tmp_path / "a.pcd", head + text(POINTS))).sensor == (1.0, 2.0, -3.5)
        head = pcd("ascii", VIEWPOINT="1 2 -3.5 1 0 0 0")
        assert read_arrays(save(tmp_path / "b.pcd", head + text(POINTS))).sensor is None

    def test_points_without_a_measurement(self, tmp_path):
        body = "nan nan nan\n" + text(POINTS[1:])
        assert np.isnan(read_arrays(save(tmp_path / "a.pcd", pcd("ascii") + body)).points[0]).all()

    @pytest.mark.parametrize(
        ("content", "reason"),
        [
            (b"hello\n", "its header has a line that no PCD file has"),
            (b"VERSION .7\n", "its header has no end"),
            (pcd("ascii", "x y", "8 8", "F F"), "does not describe points with x, y and z"),
            (pcd("ascii", "x y z", "8 8", "F F F"), "does not describe points with x, y and z"),
            (pcd("ascii", "x y z x", "8 8 8 8", "F F F F"), "does not describe points with x, y and z"),
            (pcd("ascii", COUNT="2 1 1"), "does not describe points with x, y and z"),
            (pcd("ascii", COUNT="-1 1 1"), "count that is no whole number"),
            (pcd("ascii", types="F F G"), "type that no PCD file has"),
            (pcd("ascii", POINTS="many"), "POINTS that is no whole number"),
            (pcd("ascii", height=7, VIEWPOINT="a b c") + text(POINTS), "VIEWPOINT that is no point"),
            (pcd("runes"), "does not say how the data are written"),
            (pcd("ascii") + text(POINTS[:-1]), "it ends too early"),
            (pcd("ascii") + "x " + text(POINTS), "text where numbers should be"),
            (pcd("ascii", types="U F F") + text(-POINTS), "a number that does not fit its type"),
            (pcd("binary").encode() + POINTS.tobytes()[:-1], "it ends too early"),
            (pcd("binary_compressed"), "it ends too early"),
            (pcd("binary_compressed").encode() + struct.pack("<II", 1, 9) + b"\0", "another size"),
            (pcd("binary_compressed").encode() + struct.pack("<II", 2, 1680) + b"\x20\x05", "are damaged"),
            (pcd("binary_compressed").encode() + struct.pack("<II", 1, 1680) + b"\x20", "are damaged"),
            (pcd("binary_compressed").encode() + struct.pack("<II", 2, 1680) + b"\x00a", "are damaged"),
        ],
    )
    def test_damaged(self, tmp_path, content, reason):
        with pytest.raises(FileError, match=rf"a\.pcd cannot be read: .*{reason}"):
            read_points(save(tmp_path / "a.pcd", content))


class TestLists:
    def test_points(self, tmp_path):
        arrays = read_arrays(save(tmp_path / "a.xyz", text(POINTS)))
        assert np.array_equal(arrays.points, POINTS)
        assert arrays.colors is arrays.normals is None

    @pytest.mark.parametrize(("scale", "digits"), [(255.0, 0), (1.0, 6), (65535.0, 0)])
    def test_colors(self, tmp_path, scale, digits):
        shares = np.round(COLORS / COLORS.max() * scale, digits)
        arrays = read_arrays(save(tmp_path / "a.xyzrgb", text(POINTS, shares)))
        np.testing.assert_allclose(arrays.colors, shares / scale)
        assert arrays.normals is None

    def test_normals_and_colors_after_them(self, tmp_path):
        arrays = read_arrays(save(tmp_path / "a.xyz", text(POINTS, NORMALS, COLORS)))
        assert np.array_equal(arrays.normals, NORMALS)
        np.testing.assert_allclose(arrays.colors, COLORS / 255)

    def test_intensity_normal_and_colour_at_once(self, tmp_path):
        grey = np.arange(len(POINTS), dtype=float)[:, None]
        arrays = read_arrays(save(tmp_path / "a.pts", text(POINTS, grey, NORMALS, COLORS)))
        plain = read_arrays(save(tmp_path / "b.pts", text(POINTS, NORMALS, COLORS)))
        for name in ("points", "normals", "colors"):
            np.testing.assert_array_equal(getattr(arrays, name), getattr(plain, name))

    def test_columns_behind_the_colour_are_left_out(self, tmp_path):
        more = np.tile([7.0, 9.0], (len(POINTS), 1))
        arrays = read_arrays(save(tmp_path / "a.xyz", text(POINTS, COLORS, more)))
        plain = read_arrays(save(tmp_path / "b.xyz", text(POINTS, COLORS)))
        np.testing.assert_array_equal(arrays.points, POINTS)
        np.testing.assert_array_equal(arrays.colors, plain.colors)

    def test_pts_with_count_and_intensity(self, tmp_path):
        body = "70\n" + text(POINTS, RANDOM.integers(-2000, 2000, 70), COLORS)
        arrays = read_arrays(save(tmp_path / "a.pts", body))
        assert np.array_equal(arrays.points, POINTS)
        np.testing.assert_allclose(arrays.colors, COLORS / 255)

    def test_commas_and_comments(self, tmp_path):
        body = "# x, y, z\n//made by hand\n1, 2, 3\n\n4;5;6\n"
        assert read_arrays(save(tmp_path / "a.xyz", body)).points.tolist() == [[1, 2, 3], [4, 5, 6]]

    def test_numbers_that_are_no_colors(self, tmp_path):
        arrays = read_arrays(save(tmp_path / "a.xyz", text(POINTS, POINTS)))
        assert arrays.colors is arrays.normals is None

    @pytest.mark.parametrize(
        ("content", "reason"),
        [
            ("3\n1 2 3\n", "ends too early"),
            ("1 2\n", "fewer than 3 numbers"),
            ("a b c\n", "text where numbers should be"),
            ("# nothing\n", "it has no points"),
        ],
    )
    def test_damaged(self, tmp_path, content, reason):
        with pytest.raises(FileError, match=rf"a\.pts cannot be read: it .*{reason.removeprefix('it ')}"):
            read_points(save(tmp_path / "a.pts", content))


class TestLas:
    @pytest.fixture
    def laspy(self):
        return pytest.importorskip("laspy")

    def write(self, laspy, path, *, colors=None, classes=None):
        header = laspy.LasHeader(point_format=2, version="1.2")
        header.scales, header.offsets = [0.001] * 3, POINTS.mean(axis=0)
        las = laspy.LasData(header)
        las.x, las.y, las.z = POINTS.T
        if colors is not None:
            las.red, las.green, las.blue = colors.T
        if classes is not None:
            las.classification = classes
        las.write(str(path))
        return path

    @pytest.mark.parametrize("ending", ["las", "laz"])
    @pytest.mark.parametrize("factor", [1, 257])
    def test_points_and_colors(self, laspy, tmp_path, ending, factor):
        arrays = read_arrays(self.write(laspy, tmp_path / f"a.{ending}", colors=COLORS * factor))
        np.testing.assert_allclose(arrays.points, POINTS, atol=0.0006)
        np.testing.assert_allclose(arrays.colors, COLORS / 255)

    def test_black_is_no_color(self, laspy, tmp_path):
        assert read_arrays(self.write(laspy, tmp_path / "a.las")).colors is None

    def test_noise_is_left_out(self, laspy, tmp_path):
        classes = np.where(np.arange(70) < 10, 7, 2)
        arrays = read_arrays(self.write(laspy, tmp_path / "a.las", classes=classes))
        np.testing.assert_allclose(arrays.points, POINTS[10:], atol=0.0006)

    @pytest.mark.parametrize("ending", ["las", "laz"])
    @pytest.mark.parametrize("kept", [10, 300, 400, 700])
    def test_damaged(self, laspy, tmp_path, ending, kept):
        path = self.write(laspy, tmp_path / f"a.{ending}")
        with pytest.raises(FileError, match=rf"a\.{ending} cannot be read: it "):
            read_points(save(path, path.read_bytes()[:kept]))

    @pytest.mark.parametrize(("place", "what"), [(107, "points"), (100, "records")])
    def test_more_than_the_file_can_hold(self, laspy, tmp_path, place, what):
        path = self.write(laspy, tmp_path / "a.las")
        content = bytearray(path.read_bytes())
        content[place : place + 4] = struct.pack("<I", 4_000_000_000)
        with pytest.raises(FileError, match=f"more {what} than so short a file can hold"):
            read_points(save(path, bytes(content)))

    def test_without_laspy(self, tmp_path, monkeypatch):
        monkeypatch.setitem(__import__("sys").modules, "laspy", None)
        with pytest.raises(
            FileError, match=r"need the packages laspy and lazrs \(pip install 'laspy\[lazrs\]'\)"
        ):
            read_points(save(tmp_path / "a.las", b"LASF"))


class TestMeshFormats:
    HEADER = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n"

    def test_ply_without_faces(self, tmp_path):
        head = self.HEADER + "".join(f"property float n{axis}\n" for axis in "xyz")
        head += "".join(f"property uchar {name}\n" for name in ("red", "green", "blue")) + "end_header\n"
        cloud = read_points(save(tmp_path / "a.ply", head + "1 2 3 0 0 1 255 0 51\n4 5 6 0 1 0 0 0 0\n"))
        assert np.asarray(cloud.points).tolist() == [[1, 2, 3], [4, 5, 6]]
        assert np.asarray(cloud.normals).tolist() == [[0, 0, 1], [0, 1, 0]]
        np.testing.assert_allclose(np.asarray(cloud.colors), [[1, 0, 0.2], [0, 0, 0]])

    @pytest.mark.parametrize(
        ("name", "content"), [("a.obj", "v 1 2 3\nv 4 5 6\n"), ("a.off", "OFF\n2 0 0\n1 2 3\n4 5 6\n")]
    )
    def test_obj_and_off_without_faces(self, tmp_path, name, content):
        cloud = read_points(save(tmp_path / name, content))
        assert np.asarray(cloud.points).tolist() == [[1, 2, 3], [4, 5, 6]]

    def test_a_mesh_is_no_cloud(self, tmp_path):
        path = save(tmp_path / "a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
        with pytest.raises(MeshError, match=r"a\.off is a mesh of 1 triangles: read it with read_mesh"):
            read_points(path)

    def test_no_points_at_all(self, tmp_path):
        path = save(tmp_path / "a.pcd", pcd("ascii", POINTS="0"))
        with pytest.raises(MeshError, match="nothing in it"):
            read_points(path)


@pytest.mark.parametrize("ending", READABLE_CLOUDS)
@pytest.mark.parametrize("content", [b"", b"hello\n", bytes(range(256)), b"\0" * 400])
def test_rubbish(tmp_path, ending, content):
    with pytest.raises(FileError, match=rf"a\{ending} "):
        read_points(save(tmp_path / f"a{ending}", content))


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("kind", ["ascii", "binary", "compressed", "las", "laz", "xyz"])
def test_mutated_files_are_read_or_refused(tmp_path, kind, seed):
    path = tmp_path / f"a.{kind if kind in ('las', 'laz', 'xyz') else 'pcd'}"
    if kind in ("las", "laz"):
        TestLas().write(pytest.importorskip("laspy"), path)
    else:
        cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(POINTS))
        words = {"write_ascii": kind == "ascii", "compressed": kind == "compressed"}
        o3d.io.write_point_cloud(str(path), cloud, **words)
    whole = path.read_bytes()
    random = np.random.default_rng(seed)
    for _ in range(2 if kind == "laz" else 20):
        content = bytearray(whole)
        for place in random.integers(0, len(whole), 3):
            content[place] = random.integers(0, 256)
        try:
            assert len(read_points(save(path, bytes(content))).points)
        except (FileError, MeshError):
            continue  # anything else, a segmentation fault included, fails
