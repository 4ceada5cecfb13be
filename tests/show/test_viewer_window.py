"""A real window on a real screen: keys are pressed, pictures of the screen are compared."""

import sys
import time

import numpy as np
import open3d as o3d
import pytest
from PIL import Image

from o3d_relief.scene.demo import demo_scene
from screen import Program

BACKGROUND = np.array([222, 222, 221])


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    """A coarse copy of the built-in scene, with its colours."""
    path = tmp_path_factory.mktemp("scene") / "scene.ply"
    mesh = demo_scene()
    extent = float(np.max(mesh.get_max_bound() - mesh.get_min_bound()))
    o3d.io.write_triangle_mesh(str(path), mesh.simplify_vertex_clustering(extent / 60))
    return path


@pytest.fixture
def run(request, screen, scene, tmp_path):
    options = getattr(request, "param", ["-k", "24", "--no-in-order"])
    words = [sys.executable, "-m", "o3d_relief", "view", str(scene), *options]
    program = Program(screen, words, tmp_path)
    yield program
    program.end()


class Hand:
    """Presses keys and looks at the screen."""

    def __init__(self, screen, run):
        self.screen, self.run = screen, run
        self.window = screen.window("o3d-relief: scene.ply")
        screen.do("windowfocus", self.window)

    def press(self, key, words=""):
        """Press a key, wait until the viewer says the words and the picture is another, return it."""
        said, before = len(self.run.lines()), self.screen.picture()
        self.screen.do("key", key)
        if words:
            self.run.wait_for(words, said)
        return self.screen.settled(other_than=before)


def drawn(picture):
    """Tell where something is drawn."""
    return np.any(np.abs(picture.astype(int) - BACKGROUND) > 2, axis=2)


def changed(first, second):
    return float(np.any(first != second, axis=2).mean())


@pytest.mark.slow
def test_keys_lead_through_the_stages(screen, run, tmp_path):
    hand = Hand(screen, run)
    run.wait_for("10/10 trim", seconds=200)
    trim = screen.settled()

    scene = hand.press("1", "1/10 scene")
    assert changed(trim, scene) > 0.05
    perspective = hand.press("Right", "2/10 perspective")
    visible = hand.press("n", "3/10 visibility, ")
    assert "colours: visible" in run.lines()[-1]
    assert changed(perspective, visible) > 0.1  # painted ...
    assert (drawn(perspective) != drawn(visible)).mean() < 0.001  # ... and the camera stays put
    assert np.array_equal(hand.press("Left", "2/10 perspective"), perspective)

    clusters = hand.press("4", "4/10 clusters")
    assert "colours: cluster" in run.lines()[-1]
    assert changed(visible, clusters) > 0.1
    own = hand.press("c", "colours: shade")
    assert changed(own, clusters) > 0.1
    assert changed(own, hand.press("p", "3/10 visibility, ")) > 0.0

    # The points, then the scene's wires: both only add to the picture, and go again.
    plain = hand.press("5", "5/10 attenuation, ")
    points = hand.press("a", "points")
    assert 0.0005 < changed(plain, points) < 0.05
    assert np.array_equal(hand.press("a", "5/10 attenuation"), plain)
    built = hand.press("6", "6/10 construction")
    wires = hand.press("o", "wireframe")
    assert changed(built, wires) > 0.02
    assert drawn(wires).sum() > drawn(built).sum()
    assert np.array_equal(hand.press("o", "6/10 construction"), built)

    # The mouse turns the scene, V brings it back.
    screen.drag(hand.window, (600, 400), (720, 430))
    assert changed(screen.settled(other_than=built), built) > 0.05
    assert changed(hand.press("v"), built) < 0.001

    screen.do("key", "s")
    run.wait_for("saved o3d-relief-construction-1.png")
    with Image.open(tmp_path / "o3d-relief-construction-1.png") as saved:
        picture = np.asarray(saved)
    shell = screen.do("getwindowgeometry", "--shell", hand.window).split()
    x, y = (int(word.split("=")[1]) for word in shell[1:3])
    on_screen = built[y : y + picture.shape[0], x : x + picture.shape[1]]
    assert np.abs(picture[: len(on_screen)].astype(int) - on_screen).mean() < 1.0

    said = len(run.lines())
    screen.do("key", "h")
    run.wait_for("the attenuation points, on or off", said)
    screen.do("key", "q")
    assert run.process.wait(timeout=30) == 0


@pytest.mark.slow
def test_morph_and_blink_move_by_themselves(screen, run):
    hand = Hand(screen, run)
    run.wait_for("10/10 trim", seconds=200)
    relief = screen.settled()
    screen.do("key", "m")
    run.wait_for("morph", len(run.lines()))
    frames = _frames(screen, seconds=3.0)
    scene = screen.settled()
    assert changed(relief, scene) > 0.05
    between = [one for one in frames if changed(one, relief) > 0.001 and changed(one, scene) > 0.001]
    assert len(between) >= 2  # it has been on the way

    built = hand.press("6", "6/10 construction")
    before = len(run.lines())
    screen.do("key", "b")
    run.wait_for("blink", before)
    frames = _frames(screen, seconds=4.0)
    kinds = {changed(one, built) > 0.02 for one in frames}
    assert kinds == {True, False}  # both surfaces have been seen
    before = len(run.lines())
    screen.do("key", "b")
    run.wait_for("6/10 construction", before)
    assert np.array_equal(screen.settled(), built)


def _frames(screen, seconds):
    frames, end = [], time.monotonic() + seconds
    while time.monotonic() < end:
        frames.append(screen.picture())
        time.sleep(0.1)
    return frames


@pytest.mark.slow
@pytest.mark.parametrize("run", [["--min-gap", "0.3"]], indirect=True)
def test_closed_in_mid_computation(screen, run):
    Hand(screen, run)
    run.wait_for("1/1 scene, ")
    assert not any("order  " in line for line in run.lines())  # what takes longest is still to come
    screen.do("key", "q")
    run.wait_for("the window was closed before the relief was finished")
    assert run.process.wait(timeout=60) == 0
    assert not [line for line in run.lines() if "Traceback" in line]
