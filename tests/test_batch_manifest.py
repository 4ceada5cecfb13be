import dataclasses
from pathlib import Path

import pytest

from o3d_relief.batch_entry import BatchEntry
from o3d_relief.batch_manifest import MANIFEST, Manifest, Notes
from o3d_relief.errors import FileError


def failed(name):
    return BatchEntry(input=name, output="b.ply", status="failed", seconds=0.0, error="No.")


def open_notes(folder):
    notes = Notes(folder, "earlier")
    notes.open()
    return notes


def test_notes_count_what_was_begun(tmp_path):
    notes = open_notes(tmp_path)
    assert notes.attempts("a") == 0
    assert notes.entry("a") is None
    assert [notes.begin("a"), notes.begin("a"), notes.begin("b")] == [1, 2, 1]
    assert Notes(tmp_path, "earlier").attempts("a") == 2
    notes.keep(failed("a"))
    notes.end("a")
    assert notes.attempts("a") == 0
    assert notes.entry("a") == failed("a")
    assert notes.kept() == [failed("a")]
    notes.remove()
    assert list(tmp_path.iterdir()) == []


def test_a_note_without_its_relief_is_no_entry(tmp_path, made_entry):
    open_notes(tmp_path).keep(made_entry)
    (tmp_path / "relief.obj").write_bytes(b"old")  # killed just before it was replaced
    assert Manifest(tmp_path).entries == {}


def test_a_note_without_its_bytes_is_none(tmp_path):
    notes = open_notes(tmp_path)
    notes.keep(failed("a"))
    (note,) = tmp_path.rglob("*.json")
    note.write_bytes(bytes(note.stat().st_size))
    assert notes.entry("a") is None
    assert notes.kept() == []


def test_a_batch_that_begins_ends_what_an_earlier_one_notes(tmp_path):
    notes = open_notes(tmp_path)
    notes.keep(failed("a"))
    manifest = Manifest(tmp_path)
    assert manifest.entries == {"a": failed("a")}
    assert manifest.notes.kept() == []
    for step in (lambda: notes.begin("a"), lambda: notes.keep(failed("a")), notes.check):
        with pytest.raises(FileError, match="notes of this batch have gone"):
            step()
    manifest.notes.check()
    manifest.settle()
    assert [path.name for path in tmp_path.iterdir()] == ["manifest.jsonl"]


def test_notes_that_cannot_be_made(tmp_path):
    with pytest.raises(FileError, match=r"batch-earlier cannot be made: "):
        open_notes(tmp_path / "missing")


def test_the_last_word_on_an_input_counts(tmp_path, made_entry):
    manifest = Manifest(tmp_path)
    manifest.add(failed("x"))
    manifest.add(failed(made_entry.input))
    manifest.add(made_entry)
    manifest.notes.keep(failed("y"))
    # As after a kill: the last line was not finished, and the notes are still there.
    with (tmp_path / "manifest.jsonl").open("a") as file:
        file.write('{"input": "y", "outp')
    again = Manifest(tmp_path)
    assert again.entries == {"x": failed("x"), made_entry.input: made_entry, "y": failed("y")}
    again.settle([made_entry.input, "y", "unknown"])
    lines = (tmp_path / "manifest.jsonl").read_text().splitlines()
    assert [BatchEntry.from_line(line) for line in lines] == [made_entry, failed("y"), failed("x")]


@pytest.mark.parametrize("content", [b"{}\n", b"my own list\n", b"\xff\xfe\n"])
def test_a_file_that_is_no_manifest_is_left_alone(tmp_path, content):
    path = tmp_path / "manifest.jsonl"
    path.write_bytes(content)
    with pytest.raises(FileError, match=r"manifest\.jsonl .*ove it away"):
        Manifest(tmp_path)
    assert path.read_bytes() == content


def test_a_line_with_another_certificate_is_named(tmp_path, made_entry):
    wrong = dataclasses.replace(made_entry, certificate={"failures": None})
    (tmp_path / "manifest.jsonl").write_text(made_entry.line() + wrong.line())
    with pytest.raises(FileError, match=r"manifest\.jsonl .*line 2"):
        Manifest(tmp_path)


def test_a_manifest_that_cannot_be_written_is_told_before_the_work(tmp_path, monkeypatch):
    Manifest(tmp_path).add(failed("a"))
    opened = Path.open

    def refuse(path, mode="r", *more, **options):
        if path.name == MANIFEST and mode == "a":
            raise PermissionError(13, "Permission denied")
        return opened(path, mode, *more, **options)

    monkeypatch.setattr(Path, "open", refuse)  # as another user's file is; root may write everything
    with pytest.raises(FileError, match=r"manifest\.jsonl cannot be written: Permission denied"):
        Manifest(tmp_path)
