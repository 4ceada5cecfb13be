"""A real window of the live editor: clicked and dragged, looked at, closed."""

import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import open3d as o3d
import pytest

from o3d_relief.params_file import load_params
from o3d_relief.pipeline import make_relief
from o3d_relief.scene.demo import demo_scene
from o3d_relief.scene.read import read_mesh
from screen import SWIFTSHADER, Program

SCRIPT = """
import sys
from o3d_relief.params_file import save_params
import o3d_relief as rel

mesh = rel.read_mesh("scene.ply")
params = PARAMS
params, view = rel.edit(mesh, params, output="relief.ply", size=(700, 800))
save_params("params.json", params, view)
"""
# Where the widgets are, in pixels of the window.
WIDTH, HEIGHT = 700, 800
PANEL = WIDTH - 336
BETA, ALPHA, T1 = 167, 218, 271
SAVE, ATTACH = (PANEL + 40, 37), (PANEL + 41, 609)


@pytest.fixture
def editor(request, screen, tmp_path):
    if not SWIFTSHADER.exists():
        pytest.skip("there is no Vulkan driver that draws without a card: install Debian's chromium-common")
    mesh = demo_scene()
    extent = float(np.max(mesh.get_max_bound() - mesh.get_min_bound()))
    o3d.io.write_triangle_mesh(str(tmp_path / "scene.ply"), mesh.simplify_vertex_clustering(extent / 30))
    params = getattr(request, "param", "rel.ReliefParams(k=12, in_order=False)")
    (tmp_path / "script.py").write_text(SCRIPT.replace("PARAMS", params))
    program = Program(
        screen,
        [sys.executable, "script.py"],
        tmp_path,
        VK_ICD_FILENAMES=str(SWIFTSHADER),
        PYTHONPATH=os.environ.get("PYTHONPATH", str(Path(__file__).parents[2])),
    )
    yield program
    program.end()


def at(value, row):
    """Return the place of a slider's value between 0 and 1."""
    return round(PANEL + 20 + 308 * value), row


class Eye:
    """Looks at the window's two halves."""

    def __init__(self, screen):
        self.screen = screen
        self.window = screen.window("o3d-relief edit")
        screen.do("windowfocus", self.window)

    def halves(self, picture):
        # A new window is moved to the middle of the screen.
        shell = self.screen.do("getwindowgeometry", "--shell", self.window).split()
        left, top = (int(word.split("=")[1]) for word in shell[1:3])
        inside = picture[top : top + HEIGHT, left : left + WIDTH]
        return inside[:, :PANEL], inside[:, PANEL:]

    def wait(self, what, seconds=150.0):
        """Wait until something holds of the two halves, then until nothing moves; return them."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if what(*self.halves(self.screen.picture())):
                scene, panel = self.halves(self.screen.settled(still_for=3.0))  # the preview rests, too
                if what(scene, panel):
                    return scene, panel
            time.sleep(0.3)
        raise AssertionError("the window does not show it")


def changed(first, second):
    return float((np.abs(first.astype(int) - second) > 8).any(axis=2).mean())


def red(panel):
    """Count the pixels of the colour in which sentences are written."""
    r, g, b = panel.astype(int).transpose(2, 0, 1)
    return int(((r > 180) & (g < 150) & (b < 130) & (r - g > 80)).sum())


def closed(screen, editor):
    """Close the window; return the exit code. A window that computes may miss a key: it is pressed again."""
    for _ in range(8):
        screen.do("key", "ctrl+q")
        try:
            return editor.process.wait(timeout=15)
        except subprocess.TimeoutExpired:
            continue
    return None


def furnished(scene, _panel):
    """Tell whether the grey plate is there."""
    light = scene.max(axis=2)
    return ((light > 60) & (light < 140)).mean() > 0.03


@pytest.mark.slow
def test_sliders_points_and_files(screen, editor, tmp_path):
    eye = Eye(screen)
    scene, panel = eye.wait(furnished)
    assert red(panel) == 0

    screen.drag(eye.window, at(1.0, ALPHA), at(0.3, ALPHA))
    flat, panel = eye.wait(lambda now, _: changed(scene, now) > 0.01)

    # The middle of the relief: the point next to it turns white, and its name is told.
    screen.click(eye.window, (PANEL // 2, 400))
    chosen, named = eye.wait(lambda now, _: changed(flat, now) > 0.0002)
    assert changed(flat, chosen) < 0.02
    assert changed(panel[500:600], named[500:600]) > 0.002
    screen.click(eye.window, ATTACH)
    attached, _ = eye.wait(lambda now, _: changed(chosen, now) > 0.002)

    # t1 below t2: a sentence, and everything else stays.
    screen.drag(eye.window, at(0.6, T1), at(0.1, T1))
    still, _ = eye.wait(lambda _, panel: red(panel) > 100)
    assert changed(attached, still) < 0.01

    screen.click(eye.window, SAVE)
    end = time.monotonic() + 60
    while not (tmp_path / "relief.ply").exists():
        assert time.monotonic() < end
        time.sleep(0.2)
    assert closed(screen, editor) == 0, editor.lines()

    params, view = load_params(tmp_path / "params.json")
    assert params.alpha == pytest.approx(0.05 + 0.95 * 0.3, abs=0.03)  # the slider begins at 0.05
    assert params.discard_above == pytest.approx(0.35, abs=0.03)  # half-way, the last good one
    assert params.k == 12
    assert [edit.action for edit in params.point_edits] == ["attach"]
    again = make_relief(read_mesh(tmp_path / "scene.ply"), params, view=view)
    saved = np.asarray(read_mesh(tmp_path / "relief.ply").vertices)
    np.testing.assert_array_equal(saved, np.asarray(again.mesh.vertices))


@pytest.mark.slow
@pytest.mark.parametrize("editor", ["rel.ReliefParams(k=100, min_gap=0.2)"], indirect=True)
def test_closed_in_mid_computation(screen, editor, tmp_path):
    eye = Eye(screen)
    eye.wait(furnished)
    screen.drag(eye.window, at(0.2, BETA), at(0.5, BETA))  # the relief is made anew
    assert closed(screen, editor) == 0, editor.lines()
    params, _ = load_params(tmp_path / "params.json")
    assert params.beta > 0.2
    assert not [line for line in editor.lines() if "Traceback" in line]
