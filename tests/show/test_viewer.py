"""The viewer as a callback of a script, its window in a process of its own."""

import os
import subprocess
import sys

import open3d as o3d
import pytest

from o3d_relief.errors import DisplayError, MeshError, ParameterError
from o3d_relief.show.viewer import StageViewer
from screen import Program
from shapes import bust, to_mesh

SCRIPT = """
import sys
import open3d as o3d
import o3d_relief as rel

mesh = o3d.io.read_triangle_mesh(sys.argv[1])
with rel.StageViewer(mesh, rel.View(viewpoint=(0, 0, 400)), size=(500, 400)) as viewer:
    relief = rel.make_relief(mesh, rel.ReliefParams(k=8, depth=20, mode="attenuation"), on_stage=viewer)
    viewer.finish(relief)
    viewer.wait()
print("went on", len(relief.stages), flush=True)
rel.show_stages(relief)
print("shown again", flush=True)
viewer(relief.stages["scene"])  # nobody is there any more
"""


@pytest.mark.slow
def test_a_script_is_followed_and_goes_on(screen, tmp_path):
    scene = tmp_path / "scene.ply"
    o3d.io.write_triangle_mesh(str(scene), to_mesh(bust(20)))
    (tmp_path / "script.py").write_text(SCRIPT)
    program = Program(
        screen,
        [sys.executable, "script.py", str(scene)],
        tmp_path,
        PYTHONPATH=os.environ.get("PYTHONPATH", ""),
    )
    try:
        shown = _close(screen, program, 0, "went on 10")
        _close(screen, program, shown, "shown again")
        assert program.process.wait(timeout=60) == 0
    finally:
        program.end()
    assert not any("Error" in line for line in program.lines())


def _close(screen, program, after, words):
    """Wait until all stages are there, press Q; return the number of the line that follows it."""
    program.wait_for("1/1 scene", after)
    window = screen.window("o3d-relief")
    program.wait_for("10/10 trim", after)
    screen.settled()
    screen.do("windowfocus", "--sync", window)
    screen.do("key", "q")
    return program.wait_for(words, after)


def test_no_display(monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(DisplayError, match="there is no display"):
        StageViewer()


def test_a_view_is_a_view():
    with pytest.raises(ParameterError, match="view must be a View"):
        StageViewer(view="front")


@pytest.mark.parametrize("size", [(0, 100), (100,), "large", 100])
def test_a_size_is_two_whole_numbers(size):
    with pytest.raises(ParameterError, match="size must be"):
        StageViewer(size=size)


def test_a_mesh_that_cannot_be_shown_leaves_no_process(monkeypatch):
    started = []

    class Process(subprocess.Popen):
        def __init__(self, words, **options):
            super().__init__([sys.executable, "-c", "import sys; sys.stdin.read()"], **options)
            started.append(self)

    monkeypatch.setattr("o3d_relief.show.viewer.require_display", lambda: None)
    monkeypatch.setattr("o3d_relief.show.viewer.subprocess.Popen", Process)
    with pytest.raises(MeshError, match="no triangles to draw"):
        StageViewer(o3d.geometry.TriangleMesh())
    (process,) = started
    assert process.returncode is not None
    assert process.stdin.closed
    with StageViewer() as viewer:
        viewer.close()
        viewer.wait()  # no error of the window
    broken = StageViewer()
    started[-1].kill()
    with pytest.raises(DisplayError, match="ended with an error"):
        broken.wait()
    broken.close()
    with pytest.raises(DisplayError, match="ended with an error"):
        broken.wait()  # closing hides nothing
