"""What a batch has done: a line for each input, and what is noted while it is under way."""

from __future__ import annotations

import secrets
import shutil
from collections.abc import Iterable
from hashlib import sha256
from pathlib import Path

from o3d_relief.batch_entry import BatchEntry
from o3d_relief.errors import FileError
from o3d_relief.files import write_bytes

__all__ = ["MANIFEST", "Manifest", "Notes", "read_entries"]

MANIFEST = "manifest.jsonl"
_NOTES = ".o3d-relief-batch-"
"""Start of the name of the folder for notes; that of the batch follows."""


class Notes:
    """What workers note in the folder of a batch, each about its input alone.

    A relief is noted with its checksum just before its file appears: whenever everything is killed, it is
    known afterwards which reliefs are done.

    Workers may outlive a batch that is killed. The next one takes away the place where they note; without it
    they neither note nor write anything.

    Parameters
    ----------
    folder : Path
        Of the batch.
    run : str
        Name of the batch, which no other one has.
    """

    def __init__(self, folder: Path, run: str) -> None:
        self._folder = folder / f"{_NOTES}{run}"

    def open(self) -> None:
        """Make the place for notes; FileError where that cannot be."""
        try:
            self._folder.mkdir()
        except OSError as error:
            raise FileError(f"The folder {self._folder} cannot be made: {error.strerror}.") from error

    def check(self) -> None:
        """Check that the place is there still; FileError where it is not."""
        if not self._folder.is_dir():
            raise FileError(
                f"The notes of this batch have gone from the folder {self._folder.parent}: another batch has "
                "begun there, or they were removed. Start this one again when no other is under way."
            )

    def attempts(self, source: str) -> int:
        """Return how often an input was begun and not ended, which takes the worker's death."""
        path = self._path(source, "begun")
        return path.stat().st_size if path.exists() else 0

    def begin(self, source: str) -> int:
        """Note that an input is begun; return how often it was by now."""
        self.check()
        with self._path(source, "begun").open("ab") as file:
            file.write(b".")  # a byte each time: there is no half-written number
        return self.attempts(source)

    def keep(self, entry: BatchEntry) -> None:
        """Note what became of an input."""
        self.check()
        write_bytes(self._path(entry.input, "json"), entry.line().encode())

    def end(self, source: str) -> None:
        """Note that an input is no longer worked on."""
        self._path(source, "begun").unlink(missing_ok=True)

    def entry(self, source: str) -> BatchEntry | None:
        """Return the entry that was kept of an input, None for none."""
        return _read_note(self._path(source, "json"))

    def kept(self) -> list[BatchEntry]:
        """Return all entries that were kept."""
        return _read_notes(self._folder)

    def remove(self) -> None:
        """Take all notes away."""
        shutil.rmtree(self._folder, ignore_errors=True)

    def _path(self, source: str, ending: str) -> Path:
        return self._folder / f"{sha256(source.encode('utf-8', 'surrogateescape')).hexdigest()[:32]}.{ending}"


def _read_notes(*places: Path) -> list[BatchEntry]:
    found = [_read_note(path) for place in places for path in sorted(place.glob("*.json"))]
    return [entry for entry in found if entry is not None]


def _read_note(path: Path) -> BatchEntry | None:
    """Return the entry, None where there is none: after a power cut a file may be there without its bytes."""
    try:
        return BatchEntry.from_line(path.read_text(encoding="utf-8"))
    except (FileNotFoundError, ValueError):
        return None


class Manifest:
    """The file manifest.jsonl of a batch's folder, together with the notes of batches that were killed.

    While a batch is under way a line is added for each input that is done; in the end there is one line for
    each input, in order.

    Parameters
    ----------
    folder : Path
        Must exist.

    Raises
    ------
    FileError
        The file is there and no manifest, or nothing can be written.
    """

    def __init__(self, folder: Path) -> None:
        self._path = folder / MANIFEST
        self.run = secrets.token_hex(8)
        self.notes = Notes(folder, self.run)
        self.entries: dict[str, BatchEntry] = {}
        for entry in _lines(self._path):
            self.entries[entry.input] = entry
        if self._path.exists():
            self._append("")  # another user's may not be ours to write: now, not after the first relief
        if _read_notes(*_places(folder)):
            self.settle()
        for place in _places(folder):  # from here on, notes are those of this batch
            shutil.rmtree(place, ignore_errors=True)
        self.notes.open()

    def add(self, entry: BatchEntry) -> None:
        """Add what became of an input."""
        self.entries[entry.input] = entry
        self._append(entry.line())

    def _append(self, text: str) -> None:
        try:
            with self._path.open("a", encoding="utf-8", newline="\n") as file:
                file.write(text)
        except OSError as error:
            raise FileError(f"{self._path} cannot be written: {error.strerror}.") from error

    def settle(self, order: Iterable[str] = ()) -> None:
        """Write the manifest anew, one line for each input, with what only the notes say; remove these.

        Parameters
        ----------
        order : iterable of str
            Inputs that come first; others that the folder holds follow.
        """
        self.entries |= _noted(self._path.parent)
        inputs = dict.fromkeys([*order, *self.entries])
        self.entries = {source: self.entries[source] for source in inputs if source in self.entries}
        write_bytes(self._path, "".join(entry.line() for entry in self.entries.values()).encode())
        self.notes.remove()


def read_entries(folder: Path) -> dict[str, BatchEntry]:
    """Return what the folder of a batch holds, by input; nothing is written.

    Parameters
    ----------
    folder : Path
        May be missing.

    Raises
    ------
    FileError
        The manifest is there and is none.
    """
    return {entry.input: entry for entry in _lines(folder / MANIFEST)} | _noted(folder)


def _places(folder: Path) -> list[Path]:
    """Return the folders of notes, of this batch and of those that were killed."""
    return sorted(folder.glob(_NOTES + "*"))


def _noted(folder: Path) -> dict[str, BatchEntry]:
    # What was ended between the note and the file has no relief, or an older one.
    return {
        entry.input: entry
        for entry in _read_notes(*_places(folder))
        if not entry.made or entry.holds(folder, entry.recipe)
    }


def _lines(path: Path) -> list[BatchEntry]:
    if not path.exists():
        return []
    try:
        lines = path.read_text(encoding="utf-8").split("\n")
    except (OSError, UnicodeDecodeError) as error:
        raise FileError(f"{path} cannot be read: {error}. Move it away first.") from error
    entries = []
    # After the last line break is what was being written when everything was killed; it is in the notes.
    for number, line in enumerate(lines[:-1], start=1):
        try:
            entries.append(BatchEntry.from_line(line))
        except ValueError as error:
            raise FileError(
                f"{path} is not the manifest of a batch, see line {number}: move it away, or "
                "choose another folder."
            ) from error
    return entries
