"""One batch at a time in a folder."""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from o3d_relief.errors import FileError

__all__ = ["LOCK", "check_sole", "sole_batch"]

LOCK = ".o3d-relief.lock"
"""The file that a running batch holds."""

_HELD = (errno.EACCES, errno.EAGAIN, errno.EDEADLK)
_NO_LOCKS = (errno.ENOLCK, errno.ENOSYS, errno.ENOTSUP, errno.EOPNOTSUPP)


@contextmanager
def sole_batch(folder: Path) -> Iterator[None]:
    """Keep other batches out of a folder while the block runs.

    Two batches would take each other's notes and unfinished files for what a killed one has left, and give
    one name to two reliefs. The system holds the lock, and gives it up when the process ends, however it
    ends. On a file system that knows no locks nobody is kept out.

    Parameters
    ----------
    folder : Path
        Of the batch; must exist. It holds a small file during the block.

    Raises
    ------
    FileError
        Another batch is under way there, nothing can be written there, or the file that a killed one has left
        cannot be locked.
    """
    descriptor = _sole(folder, create=True)
    try:
        yield
    finally:
        _let_go(folder / LOCK, descriptor)


def check_sole(folder: Path) -> None:
    """Check that no other batch is under way in a folder; nothing is written.

    Parameters
    ----------
    folder : Path
        May be missing.

    Raises
    ------
    FileError
        As `sole_batch`.
    """
    with suppress(FileNotFoundError):
        os.close(_sole(folder, create=False))


def _sole(folder: Path, *, create: bool) -> int:
    path = folder / LOCK
    try:
        descriptor = _locked(path, os.O_CREAT if create else 0)
    except OSError as error:
        if not create and isinstance(error, FileNotFoundError):
            raise
        if os.path.isfile(path):  # noqa: PTH113, which would raise where the folder may not be entered
            raise FileError(
                f"{path} cannot be locked: {error.strerror}. Remove it if no other batch is under way there, "
                "or choose another folder."
            ) from error
        raise FileError(
            f"Nothing can be written in the folder {folder}: {error.strerror}. Choose another one."
        ) from error
    if descriptor is None:
        raise FileError(
            f"Another batch is under way in the folder {folder}: wait until it has ended, or choose another "
            "folder."
        )
    return descriptor


def _let_go(path: Path, descriptor: int) -> None:
    """Give a lock up, and take its file away; one that may not be removed does no harm."""
    if sys.platform == "win32":  # an open file cannot be removed: ours must be closed, others' stay
        os.close(descriptor)
    with suppress(OSError):
        path.unlink(missing_ok=True)
    if sys.platform != "win32":  # only now: nobody else's goes
        os.close(descriptor)


def _locked(path: Path, create: int) -> int | None:
    """Return the descriptor of a file that this batch alone holds, None where another does."""
    while True:
        descriptor = _opened(path, create)
        try:
            held = _lock(descriptor)
            # Between the two steps the other batch may have ended, and taken the file with it.
            if held and _is_there(path, descriptor):
                return descriptor
        except BaseException:
            os.close(descriptor)
            raise
        os.close(descriptor)
        if not held:
            return None


def _opened(path: Path, create: int) -> int:
    try:
        return os.open(path, os.O_RDWR | create, 0o666)
    except PermissionError:
        if not os.path.isfile(path):  # noqa: PTH113
            raise
        return os.open(path, os.O_RDONLY)  # another user's; on most file systems that is enough for a lock


def _is_there(path: Path, descriptor: int) -> bool:
    try:
        return os.path.samestat(os.fstat(descriptor), path.stat())
    except FileNotFoundError:
        return False


def _lock(descriptor: int) -> bool:
    """Lock a file without waiting; return whether that went well."""
    try:
        if sys.platform == "win32":
            import msvcrt

            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        if error.errno not in _HELD + _NO_LOCKS:
            raise
        return error.errno in _NO_LOCKS
    return True
