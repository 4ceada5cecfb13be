"""A real screen for windows: Xvfb, its picture, and keys and a mouse for it."""

from __future__ import annotations

import os
import shutil
import struct
import subprocess
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

SWIFTSHADER = Path("/usr/lib/chromium/vk_swiftshader_icd.json")
_PROGRAMS = {"Xvfb": "xvfb", "xdotool": "xdotool"}


def missing() -> list[str]:
    """Return Debian's packages that a screen needs and that are not there."""
    return [package for program, package in _PROGRAMS.items() if shutil.which(program) is None]


def _alike(first: NDArray[np.uint8], second: NDArray[np.uint8]) -> bool:
    """Tell whether nothing moves; what is drawn again and again while a button is down has a little noise."""
    return int((np.abs(first.astype(np.int16) - second) > 8).any(axis=2).sum()) < 200


class Screen:
    """An X server that draws into memory."""

    def __init__(self, folder: Path, size: tuple[int, int] = (1280, 1024)) -> None:
        self._folder = folder
        # -noreset: it would throw out a program that connects while the last other one goes.
        reading, writing = os.pipe()
        self._server = subprocess.Popen(
            ["Xvfb", "-displayfd", str(writing), "-screen", "0", f"{size[0]}x{size[1]}x24",
             "-fbdir", str(folder), "-noreset", "-nolisten", "tcp", "+extension", "GLX"],
            pass_fds=[writing], stderr=subprocess.DEVNULL,
        )  # fmt: skip
        os.close(writing)
        with os.fdopen(reading) as stream:
            number = stream.readline().strip()
        assert number, "Xvfb has not started"
        self.environment = {**os.environ, "DISPLAY": f":{number}", "XDG_RUNTIME_DIR": str(folder)}
        self.environment.pop("WAYLAND_DISPLAY", None)

    def close(self) -> None:
        self._server.terminate()
        self._server.wait(timeout=20)

    def picture(self) -> NDArray[np.uint8]:
        """Return what is on the screen, (height, width, 3)."""
        content = (self._folder / "Xvfb_screen0").read_bytes()
        header = struct.unpack(">25I", content[:100])
        start = header[0] + 12 * header[19]
        width, height, line = header[4], header[5], header[12]
        assert header[11] == 32
        pixels = np.frombuffer(content[start : start + height * line], dtype=np.uint8).reshape(height, line)
        blue_green_red = pixels[:, : 4 * width].reshape(height, width, 4)[:, :, :3]
        return blue_green_red[:, :, ::-1].copy()

    def settled(
        self,
        seconds: float = 90.0,
        other_than: NDArray[np.uint8] | None = None,
        still_for: float = 1.0,
    ) -> NDArray[np.uint8]:
        """Return what is on the screen as soon as nothing moves for a while, once it is another picture."""
        end = time.monotonic() + seconds
        last, still = self.picture(), 0.0
        moved = other_than is None
        while time.monotonic() < end:
            time.sleep(0.25)
            now = self.picture()
            still = still + 0.25 if _alike(now, last) else 0.0
            moved = moved or not np.array_equal(now, other_than)
            if moved and still >= still_for:
                return now
            last = now
        raise AssertionError("the picture does not come to rest" if moved else "the picture does not change")

    def do(self, *words: object) -> str:
        """Run xdotool."""
        done = subprocess.run(
            ["xdotool", *map(str, words)],
            env=self.environment, capture_output=True, text=True, timeout=60, check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        return done.stdout

    def click(self, window: int, place: tuple[int, int]) -> None:
        """Click with the left mouse button; the window gets the time to see each movement."""
        self.drag(window, place, place)

    def drag(self, window: int, start: tuple[int, int], end: tuple[int, int]) -> None:
        """Drag with the left mouse button."""
        self.do("mousemove", "--window", window, *start)
        self.settled()
        self.do("mousedown", 1)
        now = self.settled()
        for part in (0.5, 1.0) if end != start else ():
            place = (round(a + part * (b - a)) for a, b in zip(start, end, strict=True))
            self.do("mousemove", "--window", window, *place)
            # A busy window would take all of a drag as one: it has to show each part of it.
            now = self.settled(other_than=now)
        self.do("mouseup", 1)

    def window(self, title: str, seconds: float = 120.0) -> int:
        """Wait for a window and return its number."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            done = subprocess.run(
                ["xdotool", "search", "--onlyvisible", "--name", title],
                env=self.environment, capture_output=True, text=True, timeout=60, check=False,
            )  # fmt: skip
            if done.stdout.split():
                return int(done.stdout.split()[0])
            time.sleep(0.2)
        raise AssertionError(f"no window {title!r}")


class Program:
    """A program on a screen, whose lines are read while it runs."""

    def __init__(self, screen: Screen, words: list[str], folder: Path, **environment: str) -> None:
        self._log = folder / "lines.txt"
        with self._log.open("w") as log:
            self.process = subprocess.Popen(
                words, stdout=log, stderr=log, cwd=folder, env={**screen.environment, **environment}
            )

    def lines(self) -> list[str]:
        return self._log.read_text().splitlines()

    def wait_for(self, words: str, after: int = 0, seconds: float = 120.0) -> int:
        """Wait for a line that has these words; return how many lines there are up to it."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            for number, line in enumerate(self.lines()[after:], start=after + 1):
                if words in line:
                    return number
            if self.process.poll() is not None and words not in self._log.read_text():
                break
            time.sleep(0.1)
        raise AssertionError(f"{words!r} was not said:\n" + "\n".join(self.lines()))

    def end(self) -> None:
        """Stop it if it still runs, however it hangs."""
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait(timeout=20)
