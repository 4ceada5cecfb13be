import dataclasses
import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import open3d as o3d
import pytest

from o3d_relief import PointEdit, ReliefParams, View, make_relief, save_params
from o3d_relief.arguments import parse
from o3d_relief.cli import main
from o3d_relief.scan_arguments import chosen_scan
from o3d_relief.scene.read import read_mesh
from o3d_relief.scene.write import write_mesh
from shapes import bust, grid, hills, to_mesh


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "scene.ply"
    o3d.io.write_triangle_mesh(str(path), to_mesh(bust(30)))
    return path


def _fails(capsys, *arguments):
    """Run the command, which must fail with one sentence; return it."""
    assert main([str(item) for item in arguments]) == 2
    error = capsys.readouterr().err
    sentence = error.strip().splitlines()[-1]
    assert sentence.startswith("o3d-relief: error: ")
    assert "Traceback" not in error
    return sentence


def _files(folder):
    return sorted(str(p.relative_to(folder)) for p in folder.rglob("*"))


@pytest.mark.parametrize("ending", ["ply", "obj", "stl", "glb"])
def test_make_writes_a_relief(tmp_path, scene, ending, capsys):
    out = tmp_path / f"relief.{ending}"
    assert main(["make", str(scene), str(out), "-k", "16"]) == 0
    relief = read_mesh(out)
    assert np.asarray(relief.vertices)[:, 2].min() == pytest.approx(0.0, abs=1e-6)
    told = capsys.readouterr().err
    for stage in ("scene", "visibility", "clusters", "attenuation", "construction", "trim"):
        assert f"  {stage}" in told


def test_report_says_what_happened(tmp_path, scene):
    report = tmp_path / "report.json"
    out = tmp_path / "relief.ply"
    words = [
        "make",
        str(scene),
        str(out),
        "-k",
        "16",
        "--beta",
        "0.3",
        "--depth",
        "20",
        "--mode",
        "attenuation",
        "--report",
        str(report),
    ]
    assert main(words) == 0
    values = json.loads(report.read_text())
    assert values["params"]["k"] == 16
    assert values["params"]["beta"] == 0.3
    assert values["relief_depth"] == pytest.approx(20.0)
    assert np.asarray(read_mesh(out).vertices)[:, 2].max() == pytest.approx(20.0)
    assert values["visible_behind_share"] == 0.0
    assert values["scene_depth"] > values["relief_depth"]
    assert values["stages"]["clusters"]["counts"]["clusters"] == 16
    assert values["certificate"]["visible_behind"] == 0
    assert values["certificate"]["vertex_pairs_tested"] > 0
    assert values["stages"]["construction"]["seconds"] > 0


@pytest.mark.parametrize(
    "front", [["--front", "-y"], ["--front", "0", "-1", "0"], ["--front=0,-1,0"], ["--front", "-0,-1,0"]]
)
def test_directions_in_every_spelling(tmp_path, scene, front):
    report = tmp_path / "report.json"
    words = [
        "make",
        str(scene),
        str(tmp_path / "r.ply"),
        "-k",
        "4",
        *front,
        "--up",
        "z",
        "--report",
        str(report),
    ]
    assert main(words) == 0
    assert json.loads(report.read_text())["view"]["front"] == [0, -1, 0]


def test_every_option_reaches_the_relief(tmp_path, scene):
    report = tmp_path / "report.json"
    options = {
        "-k": "8", "--beta": "0.1,0.2,0.3,0.4,0.5,0.6,0.7,0.8",
        "--discard-above": "0.9", "--attach-below": "0.1",
        "--max-order-error": "0.4", "--blend": "0.5", "--alpha": "0.7", "--alpha-min": "0.2", "--seed": "3",
    }  # fmt: skip
    words = [word for pair in options.items() for word in pair]
    points = ["--viewpoint", "0", "0", "900", "--vanishing-point", "0", "0", "-400"]
    switches = ["--no-smooth-points", "--no-in-front", "--no-in-order", "--report", str(report)]
    assert main(["make", str(scene), str(tmp_path / "r.ply"), *words, *points, *switches]) == 0
    values = json.loads(report.read_text())
    assert values["params"] == {
        "k": 8, "beta": [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8], "discard_above": 0.9, "attach_below": 0.1,
        "max_order_error": 0.4, "blend": 0.5, "alpha": 0.7, "alpha_min": 0.2, "depth": None,
        "mode": None, "attach": [],
        "smooth_points": False, "in_front": False, "in_order": False, "min_gap": 0.0, "seed": 3,
        "point_edits": [],
    }  # fmt: skip
    assert values["view"]["viewpoint"] == [0, 0, 900]
    assert values["view"]["vanishing_point"] == [0, 0, -400]


def test_a_parameter_file_is_replayed_exactly(tmp_path, scene):
    params = ReliefParams(
        k=16, beta=1 / 3, alpha=0.7, in_order=False, seed=2, point_edits=[PointEdit(vertex=300, beta=0.01)]
    )
    view = View(front="-y", up="z")
    save_params(tmp_path / "params.json", params, view)
    file = ["--params", str(tmp_path / "params.json")]
    assert main(["make", str(scene), str(tmp_path / "r.ply"), *file]) == 0
    expected = make_relief(read_mesh(scene), params, view=view).mesh
    made = read_mesh(tmp_path / "r.ply")
    assert (np.asarray(made.vertices) == np.asarray(expected.vertices)).all()
    assert (np.asarray(made.triangles) == np.asarray(expected.triangles)).all()

    report = tmp_path / "report.json"
    beside = ["--beta", "0.5", "--in-order", "--front", "z", "--up", "y", "--report", str(report)]
    assert main(["make", str(scene), str(tmp_path / "r.ply"), *beside, *file]) == 0
    values = json.loads(report.read_text())
    expected = dataclasses.asdict(dataclasses.replace(params, beta=0.5, in_order=True))
    del expected["weights"]
    assert values["params"] == json.loads(json.dumps(expected))
    assert values["view"]["front"] == [0, 0, 1]


def test_a_depth_beside_a_file_takes_the_place_of_its_alpha(tmp_path, scene):
    file, out, report = tmp_path / "params.json", tmp_path / "r.ply", tmp_path / "report.json"
    words = ["make", str(scene), str(out), "--params", str(file), "--report", str(report)]
    for given, beside, left in (
        (
            '{"alpha": 0.5, "alpha_min": 0.3}',
            ["--depth", "3"],
            {"depth": 3.0, "alpha": None, "alpha_min": None},
        ),
        ('{"depth": 9, "mode": "attenuation"}', ["--alpha-min", "0.1"], {"depth": 9, "alpha_min": 0.1}),
        (
            '{"depth": 9, "mode": "attenuation", "alpha_min": 0.1}',
            ["--depth", "7"],
            {"depth": 7, "alpha_min": 0.1},
        ),
        ('{"depth": "20%", "k": 30}', ["--alpha", "0.5"], {"depth": None, "alpha": 0.5, "k": 30}),
    ):
        file.write_text(f'{{"params": {given}}}')
        assert main([*words, *beside]) == 0
        params = json.loads(report.read_text())["params"]
        assert {name: params[name] for name in left} == left


def test_options_are_not_abbreviated(tmp_path, scene, capsys):
    with pytest.raises(SystemExit):
        main(["make", str(scene), str(tmp_path / "r.ply"), "--dept", "3"])
    told = capsys.readouterr().err
    assert "o3d-relief make: error: unrecognized arguments: --dept 3 (see o3d-relief make --help)" in told
    assert main(["make", str(scene), str(tmp_path / "r.ply"), "--k=12"]) == 0


def test_parameter_files_that_cannot_be_used(tmp_path, scene, capsys):
    file, out = tmp_path / "params.json", tmp_path / "r.ply"
    assert "does not exist" in _fails(capsys, "make", scene, out, "--params", file)
    file.write_text('{"params": {"kk": 3}}')
    assert "'kk' is not known in params" in _fails(capsys, "make", scene, out, "--params", file)
    file.write_text('{"params": {"alpha": 0.5}}')
    both = ("--depth", "3", "--alpha", "0.4")
    assert "exclude each other" in _fails(capsys, "make", scene, out, "--params", file, *both)
    assert "is the parameter file" in _fails(capsys, "make", scene, file, "--params", file)
    assert "is the parameter file" in _fails(capsys, "make", scene, out, "--params", file, "--report", file)
    assert _files(tmp_path) == ["params.json", "scene.ply"]


def test_nothing_is_overwritten_by_mistake(tmp_path, scene, capsys):
    content = scene.read_bytes()
    assert "is the input" in _fails(capsys, "make", scene, scene)
    out = tmp_path / "r.ply"
    assert "is the output" in _fails(capsys, "make", scene, out, "--report", out)
    assert "is the input" in _fails(capsys, "make", scene, out, "--report", scene)
    assert "is a file" in _fails(capsys, "make", scene, out, "--stages", scene)
    assert scene.read_bytes() == content
    assert _files(tmp_path) == ["scene.ply"]


def test_what_is_left_out_is_said(tmp_path, scene, capsys):
    mesh = read_mesh(scene)
    mesh.triangle_uvs = o3d.utility.Vector2dVector(np.full((3 * len(mesh.triangles), 2), 0.5))
    mesh.textures = [o3d.geometry.Image(np.full((2, 2, 3), 9, np.uint8))]
    path = tmp_path / "a.obj"
    write_mesh(path, mesh)
    out = tmp_path / "r.stl"
    assert main(["make", str(path), str(out), "-k", "8", "--no-in-order"]) == 0
    assert f"{out} will have no textures: STL cannot hold them; OBJ and GLB can" in capsys.readouterr().err
    (tmp_path / "a.mtl").unlink()
    assert main(["make", str(path), str(out), "-k", "8", "--no-in-order"]) == 0
    told = capsys.readouterr().err
    assert f"{path} names a.mtl, which cannot be read: what it colours is left plain" in told
    assert "cannot hold" not in told


def test_larger_than_accepted(tmp_path, scene, capsys):
    words = ["make", scene, tmp_path / "r.ply", "--max-triangles", "100"]
    assert "triangles, more than the 100 that are accepted" in _fails(capsys, *words)
    assert "--max-triangles must be a whole number" in _fails(capsys, *words[:-1], "0")
    assert _files(tmp_path) == ["scene.ply"]


def test_a_depth_alone_means_the_bounded_mode(tmp_path, scene, capsys):
    report = tmp_path / "report.json"
    out = tmp_path / "relief.ply"
    words = ["make", str(scene), str(out), "--depth", "15", "--attach", "3,40", "--report", str(report)]
    assert main([*words, "--strict"]) == 0
    values = json.loads(report.read_text())
    assert values["mode"] == "bounded"
    assert values["params"]["attach"] == [3, 40]
    assert list(values["stages"]) == ["scene", "perspective", "visibility", "bounded", "trim"]
    assert np.asarray(read_mesh(out).vertices)[:, 2].max() == pytest.approx(15.0)
    assert values["certificate"]["failures"] == []
    assert main([*words[:3], "--depth", "1e6"]) == 0
    assert "it is not stretched" in capsys.readouterr().err


@pytest.mark.parametrize("mode", ["bounded", "attenuation"])
def test_a_depth_as_a_share(tmp_path, scene, capsys, mode):
    report, out = tmp_path / "report.json", tmp_path / "relief.ply"
    words = ["make", str(scene), str(out), "--depth", "20%", "--mode", mode, "-k", "30"]
    assert main([*words, "--report", str(report)]) == 0
    values = json.loads(report.read_text())
    assert values["params"]["depth"] == "20%"
    assert values["relief_depth"] == pytest.approx(0.2 * values["scene_visible_depth"])
    assert ("without effect" in capsys.readouterr().err) == (mode == "bounded")
    assert main([*words, "--dry-run"]) == 0
    assert f"seen      {values['scene_visible_depth']:.4g} deep" in capsys.readouterr().err
    assert "--depth must be a length, or a share" in _fails(capsys, *words[:-4], "--depth", "20 mm")


def test_deeper_than_it_is(tmp_path, scene, capsys):
    assert (
        main(
            [
                "make",
                str(scene),
                str(tmp_path / "r.ply"),
                "-k",
                "8",
                "--depth",
                "1e6",
                "--mode",
                "attenuation",
            ]
        )
        == 0
    )
    assert "it is not stretched" in capsys.readouterr().err


def test_a_mesh_error_names_the_file(tmp_path, scene, capsys):
    words = ["--front", "1,0,0", "-k", "4"]
    flat = tmp_path / "flat.ply"
    o3d.io.write_triangle_mesh(str(flat), to_mesh(grid(5)))
    assert "flat.ply: The scene is seen edge-on" in _fails(capsys, "make", flat, tmp_path / "r.ply", *words)


def test_names_of_files_are_no_options(tmp_path, capsys):
    folder = tmp_path / "my min_gap scans"
    folder.mkdir()
    (folder / "x.ply").write_bytes(b"Dear sculptor")
    assert "my min_gap scans" in _fails(capsys, "make", folder / "x.ply", tmp_path / "r.ply")


def test_strict_refuses_what_the_certificate_finds(tmp_path, scene, capsys):
    out = tmp_path / "r.ply"
    sentence = _fails(capsys, "make", scene, out, "-k", "64", "--no-in-front", "--strict")
    assert "is not written (--strict): " in sentence
    assert "visible vertices lie behind" in sentence
    assert _files(tmp_path) == ["scene.ply"]
    report = tmp_path / "report.json"
    _fails(capsys, "make", scene, out, "-k", "64", "--no-in-front", "--strict", "--report", report)
    assert json.loads(report.read_text())["certificate"]["failures"]  # why is not lost
    assert not out.exists()


def test_version_and_module(tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "o3d_relief", "--version"], capture_output=True, text=True, check=False
    )
    assert done.stdout.startswith("o3d-relief ")


@pytest.mark.slow
def test_stage_pictures(tmp_path, scene):
    folder = tmp_path / "deep" / "pictures"
    assert main(["make", str(scene), str(tmp_path / "r.ply"), "-k", "16", "--stages", str(folder)]) == 0
    names = [p.name for p in sorted(folder.iterdir())]
    assert names[0] == "01_scene.png"
    assert names[-1] == "10_trim.png"
    assert len(names) == 10


def test_missing_input(tmp_path, capsys):
    assert "nothing.ply does not exist" in _fails(
        capsys, "make", tmp_path / "nothing.ply", tmp_path / "r.ply"
    )


def test_vertices_to_attach_are_whole_numbers(tmp_path, scene, capsys):
    with pytest.raises(SystemExit) as ended:
        main(["make", str(scene), str(tmp_path / "r.ply"), "--depth", "3", "--attach", "1,a"])
    assert ended.value.code == 2
    assert "whole numbers" in capsys.readouterr().err


def test_input_that_is_no_mesh(tmp_path, capsys):
    path = tmp_path / "letter.ply"
    path.write_text("Dear sculptor,\n")
    assert "letter.ply" in _fails(capsys, "make", path, tmp_path / "r.ply")
    assert _files(tmp_path) == ["letter.ply"]


def test_input_without_triangles(tmp_path, capsys):
    path = tmp_path / "cloud.ply"
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(hills(5)[0]))
    o3d.io.write_point_cloud(str(path), cloud)
    sentence = _fails(capsys, "make", path, tmp_path / "r.ply")
    assert "cloud.ply: A surface needs at least 50 points. Got the 25 points of the cloud" in sentence


def test_point_cloud_is_noticed_and_meshed(tmp_path, capsys):
    path, out, report = tmp_path / "cloud.ply", tmp_path / "relief.ply", tmp_path / "report.json"
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(hills(60)[0]))
    cloud.paint_uniform_color([0.2, 0.4, 0.6])
    o3d.io.write_point_cloud(str(path), cloud)
    words = ["make", path, out, "-k", "8", "--max-hole", "3", "--report", report, "--sensor", "0", "0", "900"]
    assert main([str(word) for word in words]) == 0
    told = capsys.readouterr().err
    assert "a point cloud of 3600 points, with colours; it is meshed first" in told
    assert told.index("  points") < told.index("  parts") < told.index("  scene")
    assert json.loads(report.read_text())["scan"]["sensor"] == [0.0, 0.0, 900.0]
    assert json.loads(report.read_text())["scan"]["max_hole"] == 3.0
    colors = np.asarray(read_mesh(out).vertex_colors)
    np.testing.assert_allclose(colors, np.tile([0.2, 0.4, 0.6], (len(colors), 1)), atol=0.01)


def test_organised_cloud_names_its_sensor(tmp_path, capsys):
    path = tmp_path / "cloud.pcd"
    head = (
        "FIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nWIDTH 40\nHEIGHT 40\nVIEWPOINT 0 0 500 1 0 0 0\nDATA binary\n"
    )
    path.write_bytes(head.encode() + hills(40)[0].tobytes())
    assert main(["make", str(path), str(tmp_path / "relief.ply"), "-k", "8"]) == 0
    assert "a point cloud of 1600 points, seen from 0 0 500; it is meshed first" in capsys.readouterr().err


def test_scan_options_need_a_point_cloud(tmp_path, scene, capsys):
    sentence = _fails(capsys, "make", scene, tmp_path / "r.ply", "--remove-ground")
    assert "scene.ply is a mesh: the options for scans are for point clouds only" in sentence


def test_outliers_zero_keeps_all():
    options = parse(["make", "a.ply", "b.ply", "--outliers", "0"])
    assert chosen_scan(options).outliers is None


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["-k", "0"], "-k must be a whole number, at least 1"),
        (["--min-gap", "1", "--no-in-order"], "--min-gap needs --in-order"),
        (["-k", "999999"], "k must be at most the number of vertices"),
        (["--alpha", "0.5", "--depth", "3"], "--alpha and --depth exclude each other"),
        (["--mode", "bounded"], "--mode bounded needs a depth"),
        (["--scan-depth", "40"], "--scan-depth must be a whole number between 3 and 13"),
        (["--depth", "3", "--attach", "99999999"], "attach must be numbers of the mesh's"),
        (["--front", "y"], "parallel"),
        (["--viewpoint", "0,0,3"], "in front of the scene"),
        (["--vanishing-point", "0,0,3"], "behind the relief plane"),
        (["--report", "missing/r.json"], "folder missing is missing"),
    ],
)
def test_wrong_options_write_nothing(tmp_path, scene, capsys, words, sentence):
    assert sentence in _fails(capsys, "make", scene, tmp_path / "r.ply", *words)
    assert _files(tmp_path) == ["scene.ply"]


@pytest.mark.parametrize(
    ("output", "sentence"),
    [
        ("relief.step", "its ending must be one of"),
        ("missing/relief.ply", "is missing"),
        (".", "is a folder"),
    ],
)
def test_wrong_outputs(tmp_path, scene, capsys, output, sentence):
    assert sentence in _fails(capsys, "make", scene, tmp_path / output)
    assert _files(tmp_path) == ["scene.ply"]


@pytest.mark.parametrize("words", [[], ["carve"], ["make"], ["make", "a.ply", "b.ply", "--front", "w"],
                                   ["make", "a.ply", "b.ply", "--beta", "high"],
                                   ["make", "a.ply", "b.ply", "--viewpoint", "1,2"]])  # fmt: skip
def test_words_it_does_not_know_end_with_2(words, capsys):
    with pytest.raises(SystemExit) as stop:
        main(words)
    assert stop.value.code == 2
    assert "Traceback" not in capsys.readouterr().err


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
@pytest.mark.parametrize("place", ["pipeline.make_relief", "scene.write.write_files"])
def test_interrupted(tmp_path, scene, capsys, monkeypatch, number, code, place):
    def interrupt(*_args, **_options):
        os.kill(os.getpid(), number)
        time.sleep(5)

    monkeypatch.setattr(f"o3d_relief.{place}", interrupt)
    before = signal.getsignal(number)
    assert main(["make", str(scene), str(tmp_path / "r.ply"), "-k", "8"]) == code
    assert signal.getsignal(number) == before
    assert "interrupted" in capsys.readouterr().err
    assert _files(tmp_path) == ["scene.ply"]


def test_help_is_instant_and_does_not_load_open3d():
    code = "import sys; from o3d_relief.cli import main\n"
    code += "try: main(['make', '--help'])\nexcept SystemExit: pass\n"
    code += "assert 'open3d' not in sys.modules and 'scipy' not in sys.modules"
    started = time.perf_counter()
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "--vanishing-point" in done.stdout
    assert time.perf_counter() - started < 2  # the machine may be busy; 0.1 s on a quiet one


@pytest.mark.slow
def test_demo(tmp_path):
    assert main(["demo", str(tmp_path / "demo")]) == 0
    names = _files(tmp_path / "demo")
    assert {"sheet.png", "relief.ply", "relief.glb", "scene.ply", "report.json"} <= set(names)
    assert sum(name.startswith("stages/") for name in names) == 10


def test_a_solid_in_millimetres(tmp_path, scene, capsys):
    out, report = tmp_path / "solid.stl", tmp_path / "report.json"
    words = ["--width-mm", "90", "--depth-mm", "15", "--shape", "ellipse", "--report", str(report)]
    assert main(["make", str(scene), str(out), "-k", "16", *words]) == 0
    size = np.ptp(np.asarray(read_mesh(out).vertices), axis=0)
    assert size[[0, 2]] == pytest.approx([90, 15], abs=1e-4)
    values = json.loads(report.read_text())
    assert values["solid"]["watertight"] is True
    assert values["solid"]["verdict"] in ("pass", "warnings")
    assert values["plate"]["shape"] == "ellipse"
    assert values["solid"]["counts"]["depth_ratio"] == pytest.approx(1.0, abs=0.05)
    assert "solid: 90.00 x" in capsys.readouterr().err


def test_strict_tells_warnings_from_failures(tmp_path, scene, capsys, monkeypatch):
    words = ["make", str(scene), str(tmp_path / "s.ply"), "-k", "8", "--strict", "--width-mm", "90"]
    assert main(words) == 0
    assert main([*words, "--depth-mm", "200"]) == 3
    assert _files(tmp_path) == ["s.ply", "scene.ply"]
    (tmp_path / "s.ply").unlink()
    monkeypatch.setattr("o3d_relief.solid.checks._SIZE_TOLERANCE", -1.0)
    assert "is not written (--strict): The solid is 90.000 mm wide" in _fails(capsys, *words)
    assert _files(tmp_path) == ["scene.ply"]


def test_dry_run_writes_nothing(tmp_path, scene, capsys):
    out = tmp_path / "solid.stl"
    assert main(["make", str(scene), str(out), "--dry-run", "--width-mm", "90", "--depth-mm", "15"]) == 0
    told = capsys.readouterr().err
    assert "size      90.00 x" in told
    assert "x 15.00 mm" in told
    assert "volume    about" in told
    assert "memory    about" in told
    assert "triangles about" in told
    assert "more" not in told
    assert main(["make", str(scene), str(out), "--dry-run", "--undercut-free"]) == 0
    told = capsys.readouterr().err
    assert "x at most" in told
    assert "volume    at most" in told
    assert ", more in a height field" in told
    assert _files(tmp_path) == ["scene.ply"]


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["-k", "99999"], "-k must be at most the number of vertices"),
        (["-k", "8", "--beta", "0.1,0.2"], "--beta must be one number or one for each of the 8"),
        (["--depth", "9", "--attach", "99999"], "--attach must be numbers of the mesh's"),
        (["--depth", "1e-9"], "--depth must be at least"),
        (["--max-triangles", "9"], "--max-triangles"),
        (["--vanishing-point", "0", "0", "-1e-9"], "--vanishing-point must lie behind the relief plane and"),
    ],
)
def test_dry_run_refuses_what_the_run_refuses(tmp_path, scene, capsys, words, sentence):
    command = ["make", scene, tmp_path / "r.ply", *words]
    refused = _fails(capsys, *command)
    assert sentence in refused
    assert _fails(capsys, *command, "--dry-run").splitlines()[-1] == refused.splitlines()[-1]


def test_dry_run_refuses_a_flat_solid(tmp_path, capsys):
    write_mesh(tmp_path / "flat.ply", to_mesh(grid(9)))
    command = ["make", tmp_path / "flat.ply", tmp_path / "s.stl", "-k", "9", "--width-mm", "50"]
    refused = _fails(capsys, *command)
    assert "it cannot become a solid" in refused
    assert _fails(capsys, *command, "--dry-run") == refused


def test_dry_run_refuses_a_solid_of_what_is_flat_where_it_is_seen(tmp_path, capsys):
    write_mesh(tmp_path / "box.obj", o3d.geometry.TriangleMesh.create_box(10, 10, 3))
    command = ["make", tmp_path / "box.obj", tmp_path / "s.stl", "--width-mm", "100", "--depth-mm", "20"]
    refused = _fails(capsys, *command)
    assert "it cannot become a solid" in refused
    assert _fails(capsys, *command, "--dry-run").splitlines()[-1] == refused.splitlines()[-1]


@pytest.mark.parametrize("option", ["--undercut-free", "--height-map"])
def test_too_many_pixels_are_refused_before_the_work(tmp_path, scene, capsys, monkeypatch, option):
    monkeypatch.setattr("o3d_relief.pipeline.make_relief", lambda *_, **__: pytest.fail("a relief was made"))
    words = ["--width-mm", "2000", "--base-mm", "50", "--mm-per-pixel", "0.01", option]
    words += [tmp_path / "h.png"] if option == "--height-map" else []
    told = _fails(capsys, "make", scene, tmp_path / "s.stl", *words)
    assert "--mm-per-pixel must be larger: 0.01 makes about 200000 x " in told
    assert _fails(capsys, "make", scene, tmp_path / "s.stl", "--dry-run", *words) == told


def test_pixels_without_memory_are_refused_before_the_work(tmp_path, scene, capsys, monkeypatch):
    command = ["make", scene, tmp_path / "s.stl", "--width-mm", "100", "--mm-per-pixel", "0.03"]
    free = [*command, "--undercut-free"]
    assert main([str(word) for word in [*free, "--dry-run"]]) == 0
    told = float(capsys.readouterr().err.split("memory    about ")[1].split()[0])
    assert told > 5.0  # 0.6 GB would be those of the relief alone
    monkeypatch.setattr("o3d_relief.limits.available_memory", lambda: 4 * 2**30)
    monkeypatch.setattr("o3d_relief.pipeline.make_relief", lambda *_, **__: pytest.fail("a relief was made"))
    refused = _fails(capsys, *free)
    assert "--mm-per-pixel must be larger: 0.03 makes about 3334 x " in refused
    assert refused.endswith(" GB of memory and 4.0 GB are free.")
    assert _fails(capsys, *free, "--dry-run") == refused
    assert main([str(word) for word in [*command, "--height-map", tmp_path / "h.png", "--dry-run"]]) == 0


def test_more_triangles_than_usual_where_they_are_asked_for(tmp_path, scene, capsys, monkeypatch):
    monkeypatch.setattr("o3d_relief.limits.MAX_TRIANGLES", 100)
    most = ["--max-triangles", "100000"]
    command = ["make", str(scene), str(tmp_path / "s.stl"), *most, "--width-mm", "90", "--depth-mm", "15"]
    assert main([*command, "--dry-run"]) == 0
    assert main([*command[:3], *most, "--dry-run"]) == 0
    assert main(command) == 0
    assert "more than the 100 that are accepted" in _fails(capsys, *command[:3], *command[5:])


def test_dry_run_of_a_relief_tells_the_unit_of_the_file(tmp_path, scene, capsys):
    assert main(["make", str(scene), str(tmp_path / "r.ply"), "--dry-run", "--depth", "9"]) == 0
    told = capsys.readouterr().err
    x, y, _ = np.ptp(np.asarray(read_mesh(scene).vertices), axis=0)
    assert f"size      {x:.4g} x {y:.4g} x 9 in the unit of the file: a surface, no solid" in told
    assert "mm3" not in told
    assert "volume" not in told


def test_dry_run_of_a_textured_mesh(tmp_path, capsys):
    mesh = to_mesh(bust(20))
    mesh.triangle_uvs = o3d.utility.Vector2dVector(np.zeros((3 * len(mesh.triangles), 2)))
    mesh.textures = [o3d.geometry.Image(np.zeros((2, 2, 3), dtype=np.uint8))]
    mesh.triangle_material_ids = o3d.utility.IntVector(np.zeros(len(mesh.triangles), dtype=np.int32))
    write_mesh(tmp_path / "scene.obj", mesh)
    assert main(["make", str(tmp_path / "scene.obj"), "s.stl", "--dry-run", "--width-mm", "90"]) == 0
    assert ", more where textures become colours" in capsys.readouterr().err


def test_a_search_that_does_not_come_to_its_end_is_told(tmp_path, scene, capsys, monkeypatch):
    words = ["make", str(scene), str(tmp_path / "r.ply"), "--depth", "9"]
    assert main(words) == 0
    assert "the search ended" not in capsys.readouterr().err
    monkeypatch.setattr("o3d_relief.linalg.interior._ROUNDS", 1)
    assert main(words) == 0
    assert "the search ended before its goal: up to " in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--width-mm", "0"], "--width-mm must be greater than 0"),
        (["--width-mm", "90", "--depth-mm", "4"], "--base-mm must be less than --depth-mm, 4"),
        (["--depth-mm", "20", "--depth", "3"], "--depth-mm and --depth exclude each other"),
        (["--depth-mm", "20", "--alpha", "0.5"], "--depth-mm and --alpha exclude each other"),
        (["--walls", "missing/w.png"], "folder missing is missing"),
        (["--walls", "w.jpg"], "w.jpg cannot be written: the picture of the walls must end in .png"),
    ],
)
def test_wrong_sizes_write_nothing(tmp_path, scene, capsys, words, sentence):
    assert sentence in _fails(capsys, "make", scene, tmp_path / "r.ply", *words)
    assert _files(tmp_path) == ["scene.ply"]


@pytest.mark.parametrize("words", [("--mode", "bounded"), ("--attach", "3"), ("--mode", "attenuation")])
def test_a_depth_in_millimetres_is_a_depth_for_every_mode(tmp_path, scene, capsys, words):
    report = tmp_path / "r.json"
    solid = ("--width-mm", "90", "--depth-mm", "15", "--report", str(report))
    assert main(["make", str(scene), str(tmp_path / "r.stl"), "-k", "16", *solid, *words]) == 0
    said = json.loads(report.read_text())
    assert said["mode"] == ("attenuation" if "attenuation" in words else "bounded")
    assert said["solid"]["size_mm"][2] == pytest.approx(15.0, abs=1e-6)
    assert said["solid"]["counts"]["depth_ratio"] == pytest.approx(1.0, abs=0.05)


@pytest.mark.slow
def test_a_picture_of_the_walls(tmp_path, scene):
    out = tmp_path / "walls.png"
    assert main(["make", str(scene), str(tmp_path / "r.ply"), "-k", "16", "--walls", str(out)]) == 0
    assert out.read_bytes()[:4] == b"\x89PNG"


def test_print_checks_name_options_as_they_are_typed(tmp_path, capsys):
    ball = o3d.geometry.TriangleMesh.create_sphere(3.0, 12).translate((0, 0, 20))
    both = o3d.geometry.TriangleMesh.create_box(30, 30, 5).translate((-15, -15, 0)) + ball
    write_mesh(tmp_path / "both.obj", both)
    command = ["make", str(tmp_path / "both.obj"), str(tmp_path / "s.stl"), "-k", "8", "--width-mm", "50"]
    assert main(command) == 0
    assert "--loose bridge ties them, --loose remove leaves them out." in capsys.readouterr().err
