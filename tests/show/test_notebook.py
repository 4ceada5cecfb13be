"""A relief in a notebook, and the notebook among the examples."""

import io
from pathlib import Path

import nbformat
import numpy as np
import pytest
from nbclient import NotebookClient
from PIL import Image

from o3d_relief.params import ReliefParams
from o3d_relief.pipeline import make_relief
from o3d_relief.show.notebook import relief_png
from shapes import bust, to_mesh

NOTEBOOK = Path(__file__).parents[2] / "examples" / "walk_through_the_stages.ipynb"


def test_a_relief_shows_the_scene_above_itself():
    relief = make_relief(to_mesh(bust(20)), ReliefParams(k=8, alpha=0.3))
    with Image.open(io.BytesIO(relief_png(relief, (60, 70)))) as picture:
        pixels = np.asarray(picture.convert("L")).astype(float)
    upper, lower = np.array_split(pixels, 2)
    assert upper[10:, 20:].std() > 10.0
    assert lower[10:, 20:].std() > 10.0
    assert relief._repr_png_()[:4] == b"\x89PNG"


@pytest.mark.slow
def test_the_notebook_runs_and_nothing_goes_out(tmp_path, monkeypatch):
    import open3d as o3d

    scene = tmp_path / "scene.ply"
    o3d.io.write_triangle_mesh(str(scene), to_mesh(bust(20)))
    monkeypatch.setenv("O3D_RELIEF_SCENE", str(scene))
    monkeypatch.delenv("OPEN3D_DISABLE_WEB_VISUALIZER", raising=False)
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    assert all(not cell.get("outputs") for cell in notebook.cells)  # it is kept without them
    NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(tmp_path)}}).execute()
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    pictures = [output for output in outputs if "image/png" in output.get("data", {})]
    assert len(pictures) == 7  # the relief and six stages
    text = "".join(output.get("text", "") for output in outputs)
    assert "WebVisualizer" not in text
    assert "trim" in text
    assert "in " in text.splitlines()[-1]


@pytest.mark.slow
def test_the_package_alone_keeps_open3d_from_the_net(tmp_path):
    code = "import o3d_relief\nrelief = o3d_relief.cotangent_laplacian\nimport open3d"
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(code)])
    NotebookClient(notebook, timeout=120, resources={"metadata": {"path": str(tmp_path)}}).execute()
    assert notebook.cells[0].outputs == []
