import io
import os
import sys

import pytest

from o3d_relief.progress_bar import BatchBar, StageBar, on_terminal, shown


class Terminal(io.StringIO):
    def isatty(self):
        return True


def watched(monkeypatch):
    """Put a terminal in place of stderr, in the test itself: pytest takes its own back after the fixtures."""
    stream = Terminal()
    monkeypatch.setattr(sys, "stderr", stream)
    return stream


def test_on_a_terminal_a_bar_comes_and_goes(monkeypatch):
    terminal = watched(monkeypatch)
    bar = StageBar()
    for share in (None, 0.0, 0.5, 1.0):
        bar("order", share)
    text = terminal.getvalue()
    assert "order" in text
    assert "100%" not in text.split("\r")[-1]
    assert text.split("\r")[-1].strip() == ""  # the line is empty again
    assert "\n" not in text


def test_the_share_is_drawn(monkeypatch):
    terminal = watched(monkeypatch)
    clock = iter(range(1000))
    monkeypatch.setattr("tqdm.std.time", lambda: float(next(clock)))
    bar = StageBar()
    bar("order", None)
    bar("order", 0.25)
    assert " 25% |" in terminal.getvalue()
    bar("trim", None)
    assert "trim" in terminal.getvalue().split("\r")[-1]
    bar.close()
    assert terminal.getvalue().split("\r")[-1].strip() == ""


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pty")
@pytest.mark.parametrize(("columns", "widest"), [(0, 79), (40, 39)])
def test_a_bar_fits_on_its_terminal(monkeypatch, columns, widest):
    import fcntl
    import pty
    import struct
    import termios

    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 0, columns, 0, 0))
    with os.fdopen(theirs, "w") as terminal, os.fdopen(ours, "rb", buffering=0) as screen:
        monkeypatch.setattr(sys, "stderr", terminal)
        bar = StageBar()
        bar("order", 0.5)
        lines = screen.read(4096).decode().split("\r")
        bar.close()
    assert "order" in lines[1]
    assert max(map(len, lines)) <= widest


def test_elsewhere_there_is_none(monkeypatch):
    stream = io.StringIO()
    monkeypatch.setattr(sys, "stderr", stream)
    bar = StageBar()
    bar("order", 0.5)
    bar.close()
    assert stream.getvalue() == ""
    assert not on_terminal()
    monkeypatch.setattr(sys, "stderr", None)  # closed when the program was started
    StageBar()("order", 0.5)
    assert not on_terminal()


def test_what_has_no_stages_is_shown_as_a_whole(monkeypatch):
    terminal = watched(monkeypatch)

    def fail():
        with shown("reading"):
            assert "reading" in terminal.getvalue().split("\r")[-1]
            raise KeyError

    with pytest.raises(KeyError):
        fail()
    assert terminal.getvalue().split("\r")[-1].strip() == ""


def test_lines_are_written_above_the_bar_of_a_batch(monkeypatch):
    terminal = watched(monkeypatch)
    bar = BatchBar()
    bar("batch", None)
    assert terminal.getvalue() == ""
    bar("batch", 0.25)
    bar.write(lambda text: terminal.write(f"{text}\n"), "x.ply -> x.ply")
    before, after = terminal.getvalue().split("x.ply -> x.ply\n")
    assert before.split("\r")[-1] == ""  # the bar was taken away before
    assert " 25% |" in before
    assert " 25% |" in after
    bar.close()
    assert terminal.getvalue().split("\r")[-1].strip() == ""
