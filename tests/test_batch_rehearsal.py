import json
import re

import numpy as np
import open3d as o3d
import pytest

import o3d_relief as rel
from o3d_relief.batch_lock import sole_batch
from o3d_relief.cli import main
from shapes import sphere, to_mesh


@pytest.fixture
def scans(tmp_path):
    """Return a folder of two balls, a flat file that fails and an empty one."""
    folder = tmp_path / "scans"
    folder.mkdir()
    o3d.io.write_triangle_mesh(str(folder / "ball.ply"), to_mesh(sphere(6)))
    o3d.io.write_triangle_mesh(str(folder / "max_triangles.ply"), to_mesh(sphere(12)))
    (folder / "empty.obj").touch()
    return folder


def _told(capsys, *words):
    code = main(["batch", *map(str, words), "-k", "4", "--no-in-order"])
    return code, capsys.readouterr().err


def _files(folder):
    return {path: path.stat().st_mtime_ns for path in folder.rglob("*")}


def test_what_is_told_is_what_is_made(tmp_path, scans, capsys):
    words = [scans, "--out", tmp_path / "out", "--depth", "40%"]
    code, told = _told(capsys, *words, "--mode", "attenuation", "--dry-run")
    assert code == 3
    assert not (tmp_path / "out").exists()
    ball = re.escape(str(scans / "ball.ply"))
    number = r"(\d\S*)"
    line = (
        f"{ball} -> ball.ply: {number} deep as seen; {number} x {number} x {number} in the unit of the file"
    )
    seen, *size = map(float, re.search(line, told).groups())
    assert f"would fail: {scans / 'empty.obj'} is empty" in told
    assert f"{tmp_path / 'out'}: 2 reliefs to make, 0 there from an earlier run\n1 of 3 inputs would" in told
    assert _told(capsys, *words, "--mode", "attenuation", "--jobs", "1")[0] == code
    made = np.asarray(rel.read_mesh(tmp_path / "out" / "ball.ply").vertices)
    assert np.ptp(made, axis=0) == pytest.approx(size, rel=1e-3)
    assert size[2] == pytest.approx(0.4 * seen, rel=1e-3)


def test_what_is_there_is_left_alone(tmp_path, scans, capsys):
    out = tmp_path / "out"
    assert _told(capsys, scans / "ball.ply", "--out", out, "--jobs", "1")[0] == 0
    # As after a run that was killed: notes, and a file that was being written.
    notes = out / ".o3d-relief-12345678"
    notes.mkdir()
    before = _files(tmp_path)
    code, told = _told(capsys, scans, "--out", out, "--dry-run")
    assert code == 3
    assert f"{scans / 'ball.ply'} -> ball.ply: there from an earlier run" in told
    assert "1 reliefs to make, 1 there from an earlier run" in told
    assert "x at most " in told
    assert _told(capsys, scans / "ball.ply", "--out", out, "--dry-run")[0] == 0
    _, told = _told(capsys, scans / "ball.ply", "--out", out, "--dry-run", "--certificates")
    assert "1 reliefs to make, 0 there" in told  # it has none yet
    assert _files(tmp_path) == before


def test_a_note_of_a_killed_run_counts(tmp_path, scans, capsys):
    out = tmp_path / "out"
    assert _told(capsys, scans / "ball.ply", "--out", out, "--jobs", "1")[0] == 0
    from o3d_relief.batch_entry import BatchEntry
    from o3d_relief.batch_manifest import Notes

    manifest = out / "manifest.jsonl"
    notes = Notes(out, "killed")
    notes.open()
    notes.keep(BatchEntry.from_line(manifest.read_text()))
    manifest.unlink()
    assert "0 reliefs to make, 1 there" in _told(capsys, scans / "ball.ply", "--out", out, "--dry-run")[1]
    assert not manifest.exists()


def test_parameters_and_meshes_are_refused_as_in_the_run(tmp_path, scans, capsys):
    words = [scans, "--out", tmp_path / "out", "--max-triangles", "30"]
    code, told = _told(capsys, *words, "--dry-run")
    _, run = _told(capsys, *words, "--jobs", "1")
    assert code == 2
    big = f"{scans / 'max_triangles.ply'}: The mesh has "
    assert f"would fail: {big}" in told
    assert [line[6:] for line in told.splitlines() if line.startswith("would ")] == [
        line[:4] + line[6:] for line in run.splitlines() if line.startswith("failed")
    ]


def test_a_point_cloud_is_meshed(tmp_path, capsys):
    cloud = to_mesh(sphere(12)).sample_points_uniformly(3000)
    o3d.io.write_point_cloud(str(tmp_path / "cloud.ply"), cloud)
    code, told = _told(capsys, tmp_path / "cloud.ply", "--out", tmp_path / "out", "--dry-run")
    assert code == 0
    assert re.search(r"cloud\.ply -> cloud\.ply: \d\S* deep as seen; .* about \d+ triangles", told)


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("file", "is a file, not a folder"),
        ("other", "is not the manifest of a batch"),
        ("third", "pictures is a file, not a folder"),
    ],
)
def test_folders_that_cannot_be_used(tmp_path, scans, capsys, name, sentence):
    (tmp_path / "third").mkdir()
    (tmp_path / "third" / "pictures").touch()
    (tmp_path / "file").touch()
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "manifest.jsonl").write_text(json.dumps({"a": 1}) + "\n")
    code, told = _told(capsys, scans, "--out", tmp_path / name, "--dry-run")
    assert code == 2
    assert sentence in told
    assert sentence in _told(capsys, scans, "--out", tmp_path / name, "--jobs", "1")[1]


def test_a_folder_in_which_a_batch_is_under_way(tmp_path, scans, capsys):
    out = tmp_path / "out"
    out.mkdir()
    words = [scans / "ball.ply", "--out", out, "--dry-run"]
    with sole_batch(out):
        before = _files(tmp_path)
        code, told = _told(capsys, *words)
        assert _files(tmp_path) == before
    assert code == 2
    assert f"Another batch is under way in the folder {out}: wait" in told
    assert _told(capsys, *words)[0] == 0
    assert list(out.iterdir()) == []


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--jobs", "0"], "--jobs must be a whole number, at least 1"),
        (["--scheduler", "tcp://h:1"], "--scheduler is the address of a cluster"),
    ],
)
def test_workers_that_cannot_be_had(tmp_path, scans, capsys, words, sentence):
    words = [scans, "--out", tmp_path / "out", *words]
    code, told = _told(capsys, *words, "--dry-run")
    assert (code, told) == _told(capsys, *words)
    assert code == 2
    assert sentence in told
