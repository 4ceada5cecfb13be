"""Where no window can be opened, a sentence says so before anything else happens."""

import subprocess
import sys
import time

import pytest

from o3d_relief.errors import DisplayError
from o3d_relief.show import display
from o3d_relief.show.display import require_display

linux = pytest.mark.skipif(sys.platform in ("darwin", "win32"), reason="every user has a display there")


@pytest.fixture(autouse=True)
def no_display(monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)


@linux
def test_no_display():
    with pytest.raises(DisplayError, match=r"there is no display: o3d-relief make .* --stages DIR draws"):
        require_display()


@linux
@pytest.mark.parametrize(("name", "value"), [("DISPLAY", ":4999"), ("WAYLAND_DISPLAY", "wayland-4999")])
def test_a_display_that_does_not_answer(monkeypatch, tmp_path, name, value):
    monkeypatch.setenv(name, value)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    with pytest.raises(DisplayError, match=f"the display {name}={value} does not answer"):
        require_display()


@linux
def test_an_x_server_answers(monkeypatch, screen):
    monkeypatch.setenv("DISPLAY", screen.environment["DISPLAY"])
    require_display()


@linux
def test_a_wayland_compositor_answers(monkeypatch, tmp_path):
    import socket

    monkeypatch.setenv("WAYLAND_DISPLAY", "wayland-7")
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as server:
        server.bind(str(tmp_path / "wayland-7"))
        server.listen()
        require_display()


@pytest.mark.parametrize("platform", ["darwin", "win32"])
def test_elsewhere_every_user_has_one(monkeypatch, platform):
    monkeypatch.setattr(display.sys, "platform", platform)
    require_display()


@linux
def test_the_command_ends_at_once(tmp_path):
    scene = tmp_path / "scene.ply"
    scene.write_bytes(b"not looked at")
    started = time.monotonic()
    done = subprocess.run(
        [sys.executable, "-m", "o3d_relief", "view", str(scene)],
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "--stages DIR" in done.stderr
    assert time.monotonic() - started < 20.0
