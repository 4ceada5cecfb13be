import re
import sys
from pathlib import Path

import numpy as np
import open3d as o3d
import pytest

from o3d_relief import limits
from o3d_relief.errors import FileError, MeshError, ParameterError
from o3d_relief.scan_params import ScanParams
from o3d_relief.scene.read import read_mesh
from o3d_relief.scene.scan import mesh_from_points


def test_free_memory_is_some_but_not_more_than_there_is():
    import psutil

    assert 2**20 < limits.available_memory() <= psutil.virtual_memory().total


@pytest.mark.parametrize(
    ("limit", "stat", "free"),
    [
        ("5000000\n", "anon 2000000\nfile 2900000\n", 3_000_000),  # caches do not count
        ("5000000\n", "anon 9000000\n", 0),
        ("max\n", "anon 2000000\n", None),
        ("5000000\n", "file 1\n", None),
    ],
)
def test_a_container_has_less(tmp_path, monkeypatch, limit, stat, free):
    everything = limits.available_memory()
    paths = [tmp_path / "limit", tmp_path / "stat"]
    for path, text in zip(paths, (limit, stat), strict=True):
        path.write_text(text)
    monkeypatch.setattr(limits, "_CONTAINERS", ((*map(str, paths), "anon"),))
    assert (
        limits.available_memory() == free if free is not None else limits.available_memory() > everything / 2
    )


@pytest.mark.skipif(sys.platform == "win32", reason="limits of POSIX")
def test_a_limit_of_the_process_counts(monkeypatch):
    import resource

    monkeypatch.setattr(resource, "getrlimit", lambda kind: (1000, 1000))
    assert limits.available_memory() == 0


def test_a_file_too_large_for_the_memory_is_not_opened(tmp_path, monkeypatch):
    path = tmp_path / "a.ply"
    path.write_bytes(b"ply\n" + bytes(1000))
    monkeypatch.setattr(limits, "available_memory", lambda: 9000)
    monkeypatch.setattr(Path, "read_bytes", lambda self: pytest.fail("it was read"))
    sentence = f"{path} is not read: it would need about 0 MB of memory and 0 MB are free. Reduce the mesh"
    with pytest.raises(FileError, match=re.escape(sentence)):
        read_mesh(path)


def test_sizes_in_words():
    with pytest.raises(FileError, match=r"about 2048\.0 GB of memory"):
        limits.check_file_size(Path("a.GLB"), 2**38)


def test_triangles():
    limits.check_triangles(1, 1)
    limits.check_triangles(limits.MAX_TRIANGLES // 1000)
    with pytest.raises(MeshError, match=r"10,000,001 triangles, more than the 10,000,000 that are accepted"):
        limits.check_triangles(10_000_001)
    with pytest.raises(MeshError, match=r"a relief of it would need about 651925\.8 GB of memory"):
        limits.check_triangles(10**12, 10**13)


def test_points_that_are_thinned_need_less(monkeypatch):
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(np.random.default_rng(0).random((4000, 3))))
    monkeypatch.setattr(limits, "available_memory", lambda: 3000 * 3999)
    with pytest.raises(MeshError, match=r"A mesh of 4,000 points would need about 11 MB of memory and 11 MB"):
        mesh_from_points(cloud)
    mesh_from_points(cloud, ScanParams(max_points=3999))


def test_pixels(monkeypatch):
    limits.check_field(100, 100, 0.5, solid=True)
    with pytest.raises(
        ParameterError, match=r"0\.5 makes 8000 x 5001 pixels of this piece, more than 40,000,000"
    ):
        limits.check_field(8000, 5001, 0.5)
    monkeypatch.setattr(limits, "available_memory", lambda: 2 * 2**30)
    limits.check_field(3000, 3000, 0.5)
    with pytest.raises(
        ParameterError, match=r"about 3000 x 3000 .* need about 10\.1 GB of memory and 2\.0 GB"
    ):
        limits.check_field(3000, 3000, 0.5, about=True, solid=True)


@pytest.mark.parametrize("most", [0, -1, 2.5, True, "many"])
def test_what_is_no_number_of_triangles(most):
    with pytest.raises(ParameterError, match="max_triangles must be a whole number, at least 1"):
        limits.check_triangles(1, most)


def test_a_whole_number_of_numpy_is_one():
    limits.check_triangles(5, np.int64(5))
    with pytest.raises(MeshError, match="more than the 4 that are accepted"):
        limits.check_triangles(5, np.int64(4))
