from pathlib import Path

import pytest

from o3d_relief.batch_entry import BatchEntry
from o3d_relief.batch_inputs import find_inputs, output_names
from o3d_relief.errors import FileError, ParameterError


def test_folders_stand_for_what_can_be_read_in_them(tmp_path):
    folder = tmp_path / "scans"
    (folder / "deeper.ply").mkdir(parents=True)
    for name in ("b.PLY", "a.xyz", "c.jpg", "d.glb"):
        (folder / name).touch()
    found = find_inputs([folder / "d.glb", folder, tmp_path / "missing.ply"])
    assert [Path(path).name for path in found] == ["d.glb", "a.xyz", "b.PLY", "missing.ply"]
    assert all(Path(path).is_absolute() for path in found)


def test_no_inputs(tmp_path):
    with pytest.raises(FileError, match="There is no mesh and no point cloud in the folder"):
        find_inputs([tmp_path])
    with pytest.raises(FileError, match=r"There is no file or folder a.ply, nor is any other"):
        find_inputs(["a.ply", tmp_path / "b.ply"])
    for wrong in ([], "scan.ply", Path("scan.ply"), None, 5, [5], [None], tmp_path.glob("*.ply")):
        with pytest.raises(ParameterError, match="inputs must be a sequence of files, at least one"):
            find_inputs(wrong)


def test_what_a_folder_is_searched_for_need_not_be_a_list(tmp_path):
    for name in ("a.ply", "b.ply", "c.obj"):
        (tmp_path / name).touch()
    found = find_inputs(tmp_path.glob("*.ply"))
    assert sorted(Path(path).name for path in found) == ["a.ply", "b.ply"]


def test_two_files_with_one_name_have_two_reliefs():
    sources = ["/a/Head.ply", "/b/head.obj", "/c/head.stl", "/a/head_2.ply"]
    names = output_names(sources, Path("/out"), {}, ".ply")
    assert [names[source] for source in sources] == ["Head.ply", "head_3.ply", "head_4.ply", "head_2.ply"]


def test_names_stay_what_they_were():
    before = BatchEntry(input="/b/head.obj", output="head.ply", status="made", seconds=1.0)
    gone = BatchEntry(input="/z/old.ply", output="old.ply", status="made", seconds=1.0)
    entries = {entry.input: entry for entry in (before, gone)}
    names = output_names(["/a/head.ply", "/b/head.obj", "/y/old.ply"], Path("/out"), entries, ".stl")
    assert names == {"/b/head.obj": "head.stl", "/a/head.ply": "head_2.stl", "/y/old.ply": "old_2.stl"}


def test_an_input_in_the_folder_of_the_reliefs_is_not_replaced():
    names = output_names(["/out/head.ply"], Path("/out"), {}, ".ply")
    assert names == {"/out/head.ply": "head_2.ply"}
