import json
import sys

import numpy as np
import open3d as o3d
import pytest
from PIL import Image

import quality
from shapes import bust, grid, to_mesh


@pytest.fixture
def folder(tmp_path):
    o3d.io.write_triangle_mesh(str(tmp_path / "bust.ply"), to_mesh(bust(16)))
    vertices, faces = bust(16)
    lying = vertices[:, [0, 2, 1]] * [1.0, -1.0, 1.0]  # its front looks to -y, z is up
    o3d.io.write_triangle_mesh(str(tmp_path / "lying.ply"), to_mesh((lying, faces)))
    manifest = "file\tup\tsuggested_view_from\nbust.ply\ty\tz+ (3/4 better)\nlying.ply\tz\ty-\n"
    (tmp_path / "MANIFEST.tsv").write_text(manifest)
    return tmp_path


def run(monkeypatch, folder, *options):
    arguments = ["quality.py", str(folder), str(folder / "out"), "--size", "48", "--shares", "0.25", *options]
    monkeypatch.setattr(sys, "argv", arguments)
    quality.main()
    return json.loads((folder / "out" / "quality.json").read_text())


def test_meshes_are_turned_as_the_manifest_says(folder):
    upright, lying = (quality.read_scene(folder, name) for name in ("bust.ply", "lying.ply"))
    assert lying.vertices == pytest.approx(upright.vertices, abs=1e-5)


@pytest.mark.slow
def test_all_methods_reach_the_depth(folder, monkeypatch, capsys):
    rows = run(monkeypatch, folder, "--meshes", "bust.ply", "--no-sheets")
    assert [row["method"] for row in rows] == list(quality.METHODS)
    for row in rows:
        assert row["quality"]["depth"] <= row["quality"]["wanted"] * (1 + 1e-9)
        if row["method"] != "attenuation":  # which may be shallower
            assert row["quality"]["depth"] == pytest.approx(row["quality"]["wanted"], rel=1e-6)
        if row["method"] != "Schueller":  # which bounds depths, but not the order
            assert row["quality"]["order_inversions"] in (None, 0)
        assert row["quality"]["visible_behind"] in (None, 0)
    table = capsys.readouterr().out
    assert "| bust | 25% |" in table
    assert table.count("**") >= 4  # the best from the front and over all views
    assert table == (folder / "out" / "quality.md").read_text() + "\n"


def test_known_rows_are_kept_and_sheets_drawn(folder, monkeypatch):
    few = ("--methods", "linear", "Cignoni")
    first = run(monkeypatch, folder, "--meshes", "bust.ply", "--no-sheets", *few)
    monkeypatch.setattr(quality, "METHODS", {name: quality.METHODS[name] for name in ("linear", "Cignoni")})
    monkeypatch.setattr(quality, "SHEET_PANEL", (60, 60))
    both = run(monkeypatch, folder, "--meshes", "bust.ply", "lying.ply", *few)
    assert both[:2] == first
    assert len(both) == 4
    with Image.open(folder / "out" / "lying.jpg") as sheet:
        assert sheet.width > 3 * 40
        assert np.ptp(np.asarray(sheet)) > 100


def test_summary_counts_what_is_known(folder, monkeypatch):
    def flat(scene, depth):  # a mesh of its own, as height fields are
        vertices, faces = grid(9)
        return quality.Made(mesh=(vertices + np.array([0.0, 0.0, depth]), faces))

    monkeypatch.setattr(quality, "METHODS", {"linear": quality.METHODS["linear"], "flat": flat})
    rows = run(monkeypatch, folder, "--meshes", "bust.ply", "--no-sheets", "--methods", "linear", "flat")
    linear, unknown = quality.summary_table(rows).splitlines()[2:]
    assert "| 100% | 0 | 0 | 100.0% |" in linear
    assert "| – | – | 100.0% |" in unknown


def test_a_method_may_leave_a_scene_out(folder, monkeypatch, capsys):
    methods = {"linear": quality.METHODS["linear"], "none": lambda scene, depth: None}
    monkeypatch.setattr(quality, "METHODS", methods)
    run(monkeypatch, folder, "--meshes", "bust.ply", "--no-sheets", "--methods", "linear", "none")
    table = capsys.readouterr().out
    assert "** | – |" in table
    assert "| none |" not in table.split("\n\n")[1]
