import json

import numpy as np
import open3d as o3d
import pytest
import trimesh
from PIL import Image

from o3d_relief.cli import main
from shapes import bust, to_mesh

SMALL = ["-k", "16", "--width-mm", "80", "--depth-mm", "14", "--margin-mm", "4"]


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    path = tmp_path_factory.mktemp("scene") / "scene.ply"
    o3d.io.write_triangle_mesh(str(path), to_mesh(bust(30)))
    return path


def _run(*words):
    return main([str(word) for word in words])


def _names(folder):
    return sorted(item.name for item in folder.iterdir())


def test_a_relief_becomes_a_3mf(tmp_path, scene):
    out = tmp_path / "relief.3mf"
    assert _run("make", scene, out, "-k", "16") == 0
    assert out.read_bytes()[:2] == b"PK"
    assert _names(tmp_path) == ["relief.3mf"]


def test_milled_relief_with_its_height_map(tmp_path, scene, capsys):
    out, grey, report = tmp_path / "relief.stl", tmp_path / "map.png", tmp_path / "report.json"
    words = ["--undercut-free", "--tool-mm", "2", "--draft-deg", "5", "--mm-per-pixel", "0.4"]
    assert _run("make", scene, out, *SMALL, *words, "--height-map", grey, "--report", report) == 0
    mesh = trimesh.load(out)
    assert mesh.is_watertight
    np.testing.assert_allclose(mesh.extents[[0, 2]], [80.0, 14.0], atol=0.01)
    down = mesh.face_normals[:, 2] < -1e-6
    assert np.ptp(mesh.triangles[down][:, :, 2]) == 0.0  # only the back looks away
    with Image.open(grey) as picture:
        step, black = float(picture.text["mm_per_grey_level"]), float(picture.text["z_of_black_mm"])
        heights = np.asarray(picture) * step + black
        assert picture.size[0] == 200
    assert heights.max() == pytest.approx(10.0, abs=0.01)
    assert heights.min() >= -4.0
    told = json.loads(report.read_text())
    assert told["milling"]["tool_mm"] == 2.0
    assert told["milling"]["mm_per_grey_level"] == step
    assert told["milling"]["undercut_free"]
    assert told["solid"]["overhang_area_mm2"] == 0.0
    assert "height field: 200 x" in capsys.readouterr().err


def test_height_map_alone_leaves_the_solid_as_it_is(tmp_path, scene):
    plain, with_map = tmp_path / "plain.stl", tmp_path / "with_map.stl"
    assert _run("make", scene, plain, *SMALL) == 0
    assert _run("make", scene, with_map, *SMALL, "--height-map", tmp_path / "map.tif") == 0
    assert plain.read_bytes() == with_map.read_bytes()
    assert (tmp_path / "map.tif").exists()


def test_tiles_are_written_instead_of_the_whole(tmp_path, scene, capsys):
    out, report = tmp_path / "relief.stl", tmp_path / "report.json"
    assert _run("make", scene, out, *SMALL, "--tile", "50x60", "--report", report) == 0
    told = json.loads(report.read_text())["tiles"]
    names = [f"relief_{number}.stl" for number in range(1, told["tiles"] + 1)]
    assert _names(tmp_path) == [*names, "report.json"]
    tiles = [trimesh.load(tmp_path / name) for name in names]
    for tile, size in zip(tiles, told["sizes_mm"], strict=True):
        assert tile.is_watertight
        assert (tile.extents[:2] <= [50.0, 60.0]).all()
        np.testing.assert_allclose(tile.extents, size, atol=0.01)
    err = capsys.readouterr().err
    assert f"{told['tiles']} tiles in" in err
    assert "seams cut" not in err  # nothing hangs
    assert f"{tmp_path / names[0]} to {names[-1]}: {told['tiles']} tiles, " in err
    assert _run("make", scene, out, *SMALL) == 0
    whole = trimesh.load(out)
    assert sum(tile.volume for tile in tiles) == pytest.approx(whole.volume, rel=0.01)


def test_a_piece_that_fits_is_not_cut(tmp_path, scene, capsys):
    assert _run("make", scene, tmp_path / "relief.stl", *SMALL, "--tile", "200x200") == 0
    assert _names(tmp_path) == ["relief.stl"]
    assert "fits in one tile" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--tool-mm", "3"], "--tool-mm needs --undercut-free or --height-map."),
        (["--mm-per-pixel", "3"], "--mm-per-pixel needs --undercut-free or --height-map."),
        (["--keep-ridges"], "--keep-ridges needs --undercut-free or --height-map."),
        (["--undercut-free", "--keep-ridges"], "--keep-ridges needs --tool-mm"),
        (["--undercut-free", "--tool-mm", "-1"], "--tool-mm must be at least 0. Got -1.0 instead."),
        (
            ["--undercut-free", "--tool-mm", "200"],
            "--tool-mm must be smaller than the piece, which is 150 mm",
        ),
        (
            ["--undercut-free", "--mm-per-pixel", "150"],
            "--mm-per-pixel must be smaller than the piece, which is 150 mm wide. Got 150 instead.",
        ),
        (
            ["--undercut-free", "--mm-per-pixel", "0"],
            "--mm-per-pixel must be greater than 0. Got 0.0 instead.",
        ),
        (["--undercut-free", "--draft-deg", "80"], "--draft-deg must be between 0 and 60. Got 80.0 instead."),
        (["--tile", "200"], "must be width x height in millimetres, such as 200x200. Got '200' instead."),
        (["--tile", "axb"], "must be width x height in millimetres"),
        (["--tile", "0x100"], "tile's width_mm must be greater than 0. Got 0.0 instead."),
        (["--tile", "5x100"], "tile's width_mm must be at least 9.4 for pins of 2 mm"),
        (["--tile", "90x90", "--pin-mm", "5"], "must be at least 6.6 mm thick for pins of 5 mm. Got 4"),
        (["--pin-mm", "3"], "--pin-mm needs --tile."),
        (["--clearance-mm", "0.1"], "--clearance-mm needs --tile."),
        (["--no-tile-numbers"], "--no-tile-numbers needs --tile."),
        (
            ["--height-map", "map.jpg"],
            "map.jpg cannot be written: its ending must be one of .png, .tif",
        ),
        (["--height-map", "missing/map.png"], "the folder missing is missing"),
    ],
)
def test_words_that_do_not_fit_are_refused_before_the_work(
    tmp_path, scene, capsys, words, sentence, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    try:
        code = _run("make", scene, "relief.stl", *words)
    except SystemExit as end:  # argparse's own
        code = end.code
    assert code == 2
    told = capsys.readouterr().err
    assert sentence in told
    assert len(told.strip().splitlines()) == 1  # nothing was begun
    assert _names(tmp_path) == []


def test_3mf_needs_no_other_word_and_solids_are_no_off(tmp_path, scene, capsys):
    assert _run("make", scene, tmp_path / "relief.off", "--width-mm", "80") == 2
    assert "its ending must be one of .3mf" in capsys.readouterr().err


@pytest.mark.parametrize("word", ["--report", "--height-map"])
def test_the_height_map_replaces_nothing_that_is_needed(tmp_path, scene, capsys, word):
    path = tmp_path / "same.png"
    words = ["--undercut-free", "--height-map", path, "--report" if word == "--report" else "--walls", path]
    assert _run("make", scene, tmp_path / "relief.stl", *words) == 2
    assert "choose another" in capsys.readouterr().err
    assert _names(tmp_path) == []


@pytest.mark.parametrize(("tile", "cut"), [("50x200", True), ("200x200", False)])
def test_a_seam_through_a_keyhole_is_told(tmp_path, scene, capsys, tile, cut):
    words = ("make", scene, tmp_path / "s.stl", *SMALL, "--base-mm", 6, "--hanging", "keyhole")
    assert _run(*words, "--tile", tile) == 0
    assert (
        "seams cut 1 of the holes that the back hangs by: choose another size" in capsys.readouterr().err
    ) == cut


def test_a_tile_does_not_replace_the_input(tmp_path, capsys):
    path = tmp_path / "relief_1.ply"
    o3d.io.write_triangle_mesh(str(path), to_mesh(bust(20)))
    before = path.read_bytes()
    assert _run("make", path, tmp_path / "relief.ply", *SMALL, "--tile", "50x60") == 2
    assert "would replace a file that is needed" in capsys.readouterr().err
    assert path.read_bytes() == before
    assert _names(tmp_path) == ["relief_1.ply"]
