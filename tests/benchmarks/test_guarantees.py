import json
import sys

import open3d as o3d
import pytest

import guarantees
import manifest
import o3d_relief as rel
from shapes import bust, to_mesh


@pytest.fixture
def folder(tmp_path):
    o3d.io.write_triangle_mesh(str(tmp_path / "bust.ply"), to_mesh(bust(16)))
    (tmp_path / "points.xyz").write_text("0 0 0\n1 0 0\n0 1 0\n")
    lines = ["file\tup\tsuggested_view_from", "bust.ply\ty\tz+ (3/4 better)", "points.xyz\tz\ty-"]
    (tmp_path / "MANIFEST.tsv").write_text("\n".join(lines) + "\n")
    return tmp_path


def run(monkeypatch, folder, *options):
    monkeypatch.setattr(sys, "argv", ["guarantees.py", str(folder), str(folder / "out"), *options])
    guarantees.main()
    return json.loads((folder / "out" / "guarantees.json").read_text())


def test_manifest(folder):
    assert manifest.files(folder) == ["bust.ply", "points.xyz"]
    assert manifest.view_of(folder, "points.xyz").front == rel.View(front="-y", up="z").front
    assert manifest.view_of(folder, "bust.ply") == rel.View()


def test_a_row_for_each_mesh_and_setting(folder, monkeypatch, capsys):
    monkeypatch.setattr(rel, "demo_scene", lambda: to_mesh(bust(16)))
    rows = run(monkeypatch, folder, "--k", "8", "16", "--beta", "0.2", "--meshes", "bust.ply", "points.xyz")
    assert [(row["mesh"], row["k"], row["beta"]) for row in rows] == [
        ("bust.ply", 8, 0.2),
        ("bust.ply", 16, 0.2),
    ]
    table = capsys.readouterr().out.splitlines()
    assert len(table) == 4
    assert table[0].count("|") == table[1].count("|") == table[2].count("|")
    for row, line in zip(rows, table[2:], strict=True):
        assert row["certificate"]["visible_tested"] > 100
        assert row["certificate"]["visible_behind"] == 0
        assert row["depth"] < row["scene_depth"]
        assert row["rest_seconds"] > 0.0
        assert row["rest_wall_seconds"] > 0.0
        assert row["guarantee_wall_seconds"] > -row["rest_wall_seconds"]
        assert line.endswith("| clean |") == (row["failures"] == [])


def test_known_rows_are_kept_and_errors_are_told(folder, monkeypatch, capsys):
    monkeypatch.setattr(rel, "demo_scene", lambda: to_mesh(bust(16)))
    options = ("--beta", "0.2", "--meshes", "bust.ply")
    first = run(monkeypatch, folder, "--k", "8", *options)
    both = run(monkeypatch, folder, "--k", "8", "100000", *options)
    assert both[:1] == first
    assert "k must be at most" in both[1]["error"]
    assert "k must be at most" in capsys.readouterr().out
