"""Files that appear whole or not at all."""

from __future__ import annotations

import os
import secrets
import shutil
from collections.abc import Iterable
from pathlib import Path

from o3d_relief.errors import FileError

__all__ = [
    "check_exists",
    "check_folder",
    "check_place",
    "clear_leftovers",
    "remove_files",
    "write_bytes",
    "write_files",
]

_WORK = ".o3d-relief-"
"""Start of the names of the folders in which files are written before they are renamed; 8 letters follow."""


def check_exists(path: str | Path) -> None:
    """Check that there is a file to read.

    Parameters
    ----------
    path : str or Path

    Raises
    ------
    FileError
        Nothing there, or a folder.
    """
    path = Path(path)
    if path.is_dir():
        raise FileError(f"{path} is a folder, not a file.")
    if not path.exists():
        raise FileError(f"{path} does not exist.")


def check_place(path: str | Path) -> None:
    """Check, before any long work, that a file can be written.

    Parameters
    ----------
    path : str or Path
        The file to be written. It may exist already: it will be replaced.

    Raises
    ------
    FileError
        A folder in place of a file, a file that is read-only, a folder that is missing or in which nothing
        can be written.
    """
    path = Path(path)
    try:
        _check(path)
    except OSError as error:  # a name that is too long, a folder that may not be entered
        if isinstance(error, FileError):
            raise
        raise FileError(f"{path} cannot be written: {error.strerror}.") from error


def _check(path: Path) -> None:
    if path.is_dir():
        raise FileError(f"{path} is a folder: give the name of a file in it.")
    if not path.parent.exists():
        raise FileError(f"{path} cannot be written, the folder {path.parent} is missing: make it first.")
    if not path.parent.is_dir():
        raise FileError(f"{path} cannot be written, {path.parent} is not a folder: choose another place.")
    if path.exists() and not os.access(path, os.W_OK):
        raise FileError(f"{path} cannot be written, it is read-only: choose another name.")
    if not os.access(path.parent, os.W_OK | os.X_OK):
        raise FileError(
            f"{path} cannot be written, the folder {path.parent} is read-only: choose another one."
        )


def check_folder(path: str | Path) -> None:
    """Check, before any long work, that files can be written into a folder, which may have to be made.

    Parameters
    ----------
    path : str or Path

    Raises
    ------
    FileError
        A file in its place or above it, no right to write there, or a drive that is not there.
    """
    path = Path(path)
    try:
        there = next((place for place in (path, *path.absolute().parents) if place.exists()), None)
    except OSError as error:  # a name that is too long, a folder that may not be entered
        raise FileError(f"The folder {path} cannot be made: {error.strerror}.") from error
    if there is None:  # a drive that is not mounted
        raise FileError(
            f"The folder {path} cannot be made, there is no {path.absolute().anchor}: choose another place."
        )
    if not there.is_dir():
        words = "" if there == path else f"The folder {path} cannot be made, "
        raise FileError(f"{words}{there} is a file, not a folder: choose another place.")
    if not os.access(there, os.W_OK | os.X_OK):
        words = f"The folder {path}" if there == path else f"The folder {path} cannot be made, {there}"
        raise FileError(f"{words} is read-only: choose another place.")


def clear_leftovers(folder: str | Path) -> None:
    """Take away what a process that was killed while it wrote has left in a folder.

    Parameters
    ----------
    folder : str or Path
        No other process may be writing to it.
    """
    for path in Path(folder).glob(_WORK + 8 * "?"):
        shutil.rmtree(path, ignore_errors=True)


def remove_files(path: str | Path, names: Iterable[str]) -> None:
    """Take a file and those that belong to it away; those that are not there do not matter.

    Parameters
    ----------
    path : str or Path
        The main file, which goes first.
    names : iterable of str
        Of the others, in its folder.

    Raises
    ------
    FileError
        A file cannot be removed.
    """
    path = Path(path)
    for one in (path, *(path.parent / name for name in names)):
        try:
            one.unlink(missing_ok=True)
        except OSError as error:
            raise FileError(f"{one} cannot be removed: {error.strerror}. Remove it yourself.") from error


def write_bytes(path: str | Path, content: bytes) -> None:
    """Write one file, all or nothing.

    Parameters
    ----------
    path : str or Path
    content : bytes

    Raises
    ------
    FileError
        The file cannot be written.
    """
    path = Path(path)
    write_files(path, {path.name: content})


def write_files(path: str | Path, files: dict[str, bytes]) -> None:
    """Write a file and those that belong to it, all or nothing.

    They are written under other names in the same folder and then renamed, the last one last: after a
    failure the folder is as it was.

    Parameters
    ----------
    path : str or Path
        The main file, for its folder and for messages.
    files : dict of str to bytes
        Contents by name; the main file last.

    Raises
    ------
    FileError
        The files cannot be written.
    """
    path = Path(path)
    check_place(path)
    try:
        _place(path.parent, files)
    except OSError as error:
        raise FileError(f"{path} cannot be written: {error.strerror or error}.") from error


def _place(folder: Path, files: dict[str, bytes]) -> None:
    # The name comes first: an interruption right after the folder is made must find it. It must not matter
    # either when it comes in the middle of the clearing; hence twice.
    work = folder / (_WORK + secrets.token_hex(4))
    try:
        try:
            work.mkdir(mode=0o700)
            _write_and_move(work, folder, files)
        finally:
            shutil.rmtree(work, ignore_errors=True)
    finally:
        shutil.rmtree(work, ignore_errors=True)


def _write_and_move(work: Path, folder: Path, files: dict[str, bytes]) -> None:
    main = list(files)[-1]
    moved = []
    try:
        (work / "new").mkdir()
        (work / "old").mkdir()
        for name, content in files.items():
            if (folder / name).is_dir():
                raise IsADirectoryError(f"{folder / name} is a folder")
            (work / "new" / name).write_bytes(content)
        for name in files:
            if name != main:
                moved.append(name)
                if (folder / name).exists():
                    (folder / name).replace(work / "old" / name)
            (work / "new" / name).replace(folder / name)
    except BaseException:
        # Once the main file is in its place, so are all.
        for name in moved if (work / "new" / main).exists() else []:
            if (work / "old" / name).exists():
                (work / "old" / name).replace(folder / name)
            elif not (work / "new" / name).exists():
                (folder / name).unlink()
        raise
