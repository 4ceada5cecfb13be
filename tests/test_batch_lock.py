import errno
import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from o3d_relief import batch_lock
from o3d_relief.batch_lock import LOCK, sole_batch
from o3d_relief.errors import FileError

HOLD = """
import sys
from pathlib import Path
from o3d_relief.batch_lock import sole_batch
with sole_batch(Path(sys.argv[1])):
    print("held", flush=True)
    sys.stdin.read()
"""


def hold(folder):
    """Start a process that holds a folder until its input ends."""
    process = subprocess.Popen(
        [sys.executable, "-c", HOLD, str(folder)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert process.stdout.readline() == "held\n"
    return process


def test_one_at_a_time(tmp_path):
    sentence = f"Another batch is under way in the folder {tmp_path}: wait"
    with sole_batch(tmp_path):
        with pytest.raises(FileError) as caught, sole_batch(tmp_path):
            pass
        assert str(caught.value).startswith(sentence)
        assert (tmp_path / LOCK).exists()
    assert not (tmp_path / LOCK).exists()
    with sole_batch(tmp_path), sole_batch(tmp_path.parent):
        pass


def test_another_process_is_kept_out_until_it_ends(tmp_path):
    process = hold(tmp_path)
    with pytest.raises(FileError, match="Another batch is under way"), sole_batch(tmp_path):
        pass
    process.communicate()
    assert process.returncode == 0
    with sole_batch(tmp_path):
        pass


def test_a_killed_process_holds_nothing(tmp_path):
    process = hold(tmp_path)
    process.kill()
    process.communicate()
    with sole_batch(tmp_path):
        pass
    assert os.listdir(tmp_path) == []  # noqa: PTH208


@pytest.mark.skipif(sys.platform == "win32", reason="Windows keeps the name of an open file")
def test_a_file_that_was_removed_meanwhile_is_made_again(tmp_path, monkeypatch):
    lock, tried = batch_lock._lock, []

    def remove_once(descriptor):
        if not tried:
            (tmp_path / LOCK).unlink()
        tried.append(descriptor)
        return lock(descriptor)

    monkeypatch.setattr(batch_lock, "_lock", remove_once)
    with sole_batch(tmp_path):
        assert len(tried) == 2
        with pytest.raises(FileError, match="Another batch"), sole_batch(tmp_path):
            pass


def test_errors_do_not_keep_the_folder(tmp_path):
    with pytest.raises(ZeroDivisionError), sole_batch(tmp_path):
        raise ZeroDivisionError
    with sole_batch(tmp_path):
        pass


def test_a_folder_where_nothing_can_be_written(tmp_path):
    (tmp_path / LOCK).mkdir()
    with pytest.raises(FileError, match=r"^Nothing can be written in the folder "), sole_batch(tmp_path):
        pass


@pytest.mark.skipif(sys.platform == "win32", reason="locks of POSIX")
def test_a_file_system_without_locks_keeps_nobody_out(tmp_path, monkeypatch):
    import fcntl

    def refuse(number):
        def flock(*_):
            raise OSError(number, os.strerror(number))

        monkeypatch.setattr(fcntl, "flock", flock)

    refuse(errno.ENOLCK)
    with sole_batch(tmp_path), sole_batch(tmp_path):
        pass
    refuse(errno.EIO)
    with pytest.raises(FileError, match=r"\.lock cannot be locked: "), sole_batch(tmp_path):
        pass


def forbid(monkeypatch, flags):
    """Let files be opened with none of these flags, and none be removed."""
    opened = os.open

    def open_some(path, asked, *mode):
        if asked & flags or flags == os.O_RDONLY:
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), path)
        return opened(path, asked, *mode)

    def unlink(path, missing_ok=False):
        raise PermissionError(errno.EPERM, os.strerror(errno.EPERM), path)

    monkeypatch.setattr(os, "open", open_some)
    monkeypatch.setattr(Path, "unlink", unlink)


def test_a_file_that_another_user_has_left(tmp_path, monkeypatch):
    (tmp_path / LOCK).touch()
    forbid(monkeypatch, os.O_RDWR | os.O_CREAT)
    with sole_batch(tmp_path), pytest.raises(FileError, match="Another batch"), sole_batch(tmp_path):
        pass
    assert (tmp_path / LOCK).exists()
    with sole_batch(tmp_path):
        pass


def test_a_file_that_may_not_even_be_read_is_named(tmp_path, monkeypatch):
    (tmp_path / LOCK).touch()
    forbid(monkeypatch, os.O_RDONLY)
    sentence = r"\.o3d-relief\.lock cannot be locked: Permission denied\. Remove it if no other batch"
    with pytest.raises(FileError, match=sentence), sole_batch(tmp_path):
        pass


@pytest.mark.skipif(sys.platform == "win32", reason="Windows itself is not put on")
def test_no_open_file_is_removed_on_windows(tmp_path, monkeypatch):
    import fcntl

    held, unlink, opened, closed = set(), Path.unlink, os.open, os.close

    def open_plain(path, flags, mode=0o777):
        assert not flags & 0x10000  # with O_TEMPORARY, who is refused would take the file away
        descriptor = opened(path, flags, mode)
        held.add(descriptor)
        return descriptor

    def close(descriptor):
        held.discard(descriptor)
        closed(descriptor)

    def unlink_closed(path, missing_ok=False):
        if held:
            raise PermissionError(errno.EACCES, "The process cannot access the file", path)
        unlink(path, missing_ok=missing_ok)

    def locking(descriptor, _mode, _bytes):
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)

    monkeypatch.setattr(os, "open", open_plain)
    monkeypatch.setattr(os, "close", close)
    monkeypatch.setattr(os, "O_TEMPORARY", 0x10000, raising=False)
    monkeypatch.setattr(Path, "unlink", unlink_closed)
    monkeypatch.setitem(sys.modules, "msvcrt", SimpleNamespace(locking=locking, LK_NBLCK=2))
    monkeypatch.setattr(sys, "platform", "win32")
    with sole_batch(tmp_path):
        with pytest.raises(FileError, match="Another batch is under way"), sole_batch(tmp_path):
            pass
        assert (tmp_path / LOCK).exists()
    assert not held
    assert not (tmp_path / LOCK).exists()
    other = open_plain(tmp_path / LOCK, os.O_RDWR | os.O_CREAT)
    with sole_batch(tmp_path):  # another one has just opened it, too
        pass
    assert (tmp_path / LOCK).exists()
    close(other)
