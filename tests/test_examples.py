import importlib.util
import os
import runpy
import subprocess
import sys
from pathlib import Path

import numpy as np
import open3d as o3d
import pytest
from PIL import Image

from o3d_relief import read_mesh
from shapes import bust, to_mesh

EXAMPLES = Path(__file__).parent.parent / "examples"


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "scene.ply"
    o3d.io.write_triangle_mesh(str(path), to_mesh(bust(30)))
    return str(path)


def _load(name):
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


FIGURES = [
    "bounded_depths",
    "figure_05_perspective",
    "figure_06_curve",
    "figure_07_attenuation",
    "figure_08_growing_k",
    "figure_09_restoration",
    "figure_10_local_beta",
    "figure_11_compression",
    "figure_12_bas_relief",
    "figure_13_gallery",
]


def test_every_example_has_a_test():
    names = {path.stem for path in EXAMPLES.glob("*.py")}
    assert names == {"start", "first_relief", "single_stages", *FIGURES}


@pytest.mark.parametrize("name", FIGURES)
def test_figures(tmp_path, scene, capsys, name):
    output = tmp_path / "figure.png"
    _load(name).main(scene, output=str(output), panel=72)
    with Image.open(output) as picture:
        pixels = np.asarray(picture.convert("L"))
    assert min(pixels.shape) >= 64
    assert np.ptp(pixels) > 100  # something is drawn
    assert capsys.readouterr().out


@pytest.mark.parametrize("name", ["figure_06_curve", "figure_07_attenuation"])
def test_what_curves_need_is_looked_at_before_the_work(tmp_path, capsys, monkeypatch, name):
    monkeypatch.setattr("o3d_relief.make_relief", None)
    start = _load("start").start
    monkeypatch.setitem(sys.modules, "matplotlib", None)  # as if it were not installed
    example = _load(name)
    start(example.main, example.__doc__, ["--help"])
    assert "Needs matplotlib" in " ".join(capsys.readouterr().out.split())
    for output, sentence in (
        (tmp_path / "figure.png", "needs matplotlib: pip install matplotlib"),
        (tmp_path / "nowhere" / "figure.png", "is missing: make it first"),
    ):
        with pytest.raises(SystemExit) as ended:
            start(example.main, example.__doc__, ["scene.ply", str(output)])
        assert ended.value.code == 2
        assert sentence in capsys.readouterr().err


def test_gallery_scenes_are_sound():
    gallery = _load("figure_13_gallery")
    knot = gallery.coil(steps=120, around=8)
    assert knot.is_watertight()
    assert knot.get_volume() > 0.0  # faces turn outwards
    assert len(np.unique(gallery.still_life().cluster_connected_triangles()[0])) == 5


def test_strip_of_the_curve_does_not_cross_itself():
    strip = _load("figure_06_curve").folded_strip(101)
    x, _, z = np.asarray(strip.vertices)[:101].T
    assert (np.diff(x) < 0.0).any()  # it overhangs
    assert not strip.is_self_intersecting()
    assert z.min() >= 0.0


def test_first_relief(tmp_path, scene, capsys):
    output = tmp_path / "relief.ply"
    _load("first_relief").main(scene, str(output))
    assert np.asarray(read_mesh(output).vertices)[:, 2].min() == 0.0
    assert "depth" in capsys.readouterr().out


def test_single_stages(scene, capsys):
    _load("single_stages").main(scene)
    before, after = capsys.readouterr().out.split("units: ")[1].split(" -> ")
    assert float(after) < float(before)


def _run(name, *words):
    words = [sys.executable, str(EXAMPLES / f"{name}.py"), *words]
    environment = {**os.environ, "PYTHONPATH": str(EXAMPLES.parent)}
    return subprocess.run(words, capture_output=True, text=True, check=False, env=environment)


@pytest.mark.parametrize("name", ["first_relief", "figure_13_gallery"])
def test_started_from_the_command_line(tmp_path, name):
    broken = tmp_path / "broken.ply"
    broken.write_bytes(b"ply\nformat ascii")
    missing = _run(name, str(tmp_path / "missing.ply"))
    for ended, told in ((missing, "missing.ply"), (_run(name, str(broken)), "broken.ply")):
        assert (ended.returncode, ended.stdout) == (2, "")
        assert len(ended.stderr.splitlines()) == 1
        assert f"{name}.py: error: " in ended.stderr
        assert told in ended.stderr


@pytest.mark.parametrize("name", ["first_relief", "single_stages", *FIGURES])
def test_help_is_the_docstring(name, capsys, monkeypatch):
    monkeypatch.syspath_prepend(EXAMPLES)
    monkeypatch.setattr("sys.argv", [f"{name}.py", "--help"])
    runpy.run_path(str(EXAMPLES / f"{name}.py"), run_name="__main__")
    told = capsys.readouterr().out
    assert told.strip() == _load(name).__doc__.strip()
    assert f"python examples/{name}.py" in told


def test_too_many_words(capsys):
    example = _load("first_relief")
    with pytest.raises(SystemExit) as ended:
        _load("start").start(example.main, example.__doc__, ["a.ply", "b.ply", "c.ply"])
    assert ended.value.code == 2
    assert "too many positional arguments, see --help" in capsys.readouterr().err


def test_other_errors_are_not_hidden():
    def main():
        raise KeyError("a mistake in the script")

    with pytest.raises(KeyError, match="a mistake"):
        _load("start").start(main, "", [])
