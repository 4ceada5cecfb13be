import importlib.util
from pathlib import Path

import numpy as np
import open3d as o3d
import pytest

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


def test_every_example_has_a_test():
    tested = {"first_relief", "single_stages"}
    assert {path.stem for path in EXAMPLES.glob("*.py")} == tested


def test_first_relief(tmp_path, scene, capsys):
    output = tmp_path / "relief.ply"
    _load("first_relief").main(scene, str(output))
    assert np.asarray(read_mesh(output).vertices)[:, 2].min() == 0.0
    assert "depth" in capsys.readouterr().out


def test_single_stages(scene, capsys):
    _load("single_stages").main(scene)
    before, after = capsys.readouterr().out.split("units: ")[1].split(" -> ")
    assert float(after) < float(before)
