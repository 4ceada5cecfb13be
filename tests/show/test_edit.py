"""What is said before the editor's window opens, or instead of it."""

import os
import subprocess
import sys

import open3d as o3d
import pytest

from o3d_relief.errors import DisplayError, FileError, MeshError, ParameterError, ReliefError
from o3d_relief.params import ReliefParams
from o3d_relief.show.edit import edit
from screen import SWIFTSHADER
from shapes import bust, to_mesh

linux = pytest.mark.skipif(sys.platform in ("darwin", "win32"), reason="every user has a display there")


@pytest.fixture
def mesh():
    return to_mesh(bust(12))


@pytest.fixture
def on_screen(monkeypatch, screen):
    monkeypatch.setenv("DISPLAY", screen.environment["DISPLAY"])
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)


@linux
def test_no_display(monkeypatch, mesh):
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(DisplayError, match="--stages DIR"):
        edit(mesh)


@linux
def test_no_vulkan_driver(monkeypatch, on_screen, mesh, tmp_path):
    monkeypatch.setenv("VK_ICD_FILENAMES", str(tmp_path / "none.json"))
    with pytest.raises(DisplayError, match="needs a Vulkan driver: install"):
        edit(mesh)


@linux
def test_the_command_says_it_too(on_screen, mesh, tmp_path):
    scene = tmp_path / "scene.ply"
    o3d.io.write_triangle_mesh(str(scene), mesh)
    done = subprocess.run(
        [sys.executable, "-m", "o3d_relief", "edit", str(scene)],
        env={**os.environ, "VK_ICD_FILENAMES": str(tmp_path / "none.json")},
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert done.returncode == 2
    assert done.stderr.startswith("o3d-relief: error: The editor's window needs a Vulkan driver")
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize(
    ("options", "error", "words"),
    [
        ({"params": {"k": 3}}, ParameterError, "params must be a ReliefParams"),
        ({"view": "front"}, ParameterError, "view must be a View"),
        ({"size_mm": 0.0}, ParameterError, "size_mm must be greater than 0"),
        ({"size_mm": "a"}, ParameterError, "size_mm must be a number"),
        ({"size": (0, 9)}, ParameterError, "size must be a whole number"),
        ({"output": "relief.xyz"}, FileError, "xyz"),
        ({"output": "missing/relief.ply"}, FileError, "the folder missing is missing|is missing"),
    ],
)
def test_what_is_wrong_is_said_first(mesh, options, error, words):
    with pytest.raises(error, match=words):
        edit(mesh, **options)


@pytest.fixture
def drawing(monkeypatch, on_screen):
    if not SWIFTSHADER.exists():
        pytest.skip("there is no Vulkan driver that draws without a card: install Debian's chromium-common")
    monkeypatch.setenv("VK_ICD_FILENAMES", str(SWIFTSHADER))


def test_a_mesh_without_faces(drawing):
    with pytest.raises(MeshError):
        edit(o3d.geometry.TriangleMesh())


@pytest.mark.slow
def test_what_cannot_be_opened_is_said_after_the_window_has_gone(drawing, mesh):
    with pytest.raises(ReliefError, match="k must be at most the number of vertices"):
        edit(mesh, ReliefParams(k=100_000))
