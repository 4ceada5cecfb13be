import dataclasses
import os
from hashlib import sha256

import pytest

from o3d_relief.batch_manifest import BatchEntry, Manifest, Notes
from o3d_relief.errors import FileError


@pytest.fixture
def made(tmp_path):
    """Return an entry whose input, relief and picture exist."""
    scan = tmp_path / "scan.ply"
    scan.write_bytes(b"points")
    (tmp_path / "pictures").mkdir()
    (tmp_path / "pictures" / "relief.png").touch()
    (tmp_path / "relief.obj").write_bytes(b"faces")
    return BatchEntry(
        input=str(scan), output="relief.obj", status="made", seconds=1.5, depth=1 / 3, triangles=7,
        notes=("no textures", "Größe"), attempts=2, input_bytes=6, input_mtime_ns=scan.stat().st_mtime_ns,
        recipe="abc", output_sha256=sha256(b"faces").hexdigest(),
        certificate={"visible_behind": 2, "places": [{"where": [0.1, 1 / 3]}], "failures": ["2 lie behind."]},
    )  # fmt: skip


def failed(name):
    return BatchEntry(input=name, output="b.ply", status="failed", seconds=0.0, error="No.")


def test_a_line_says_all(made):
    assert made.failures == ("2 lie behind.",)
    assert failed("b.ply").failures == ()
    line = made.line()
    assert line.endswith("}\n")
    assert line.count("\n") == 1
    assert BatchEntry.from_line(line) == made


@pytest.mark.parametrize("line", ["", "{}", "[1]", "3", '{"input": "a"}', '{"notes": [], "other": 3}', "{"])
def test_other_lines_are_refused(line):
    with pytest.raises(ValueError, match=r"line of a batch|Expecting"):
        BatchEntry.from_line(line)


@pytest.mark.parametrize("certificate", [{}, 5, [], {"failures": None}, {"failures": "x"}, {"failures": [1]}])
def test_other_certificates_are_refused(tmp_path, made, certificate):
    line = dataclasses.replace(made, certificate=certificate).line()
    with pytest.raises(ValueError, match="not a line of a batch"):
        BatchEntry.from_line(line)
    (tmp_path / "manifest.jsonl").write_text(line)
    with pytest.raises(FileError, match=r"manifest\.jsonl .*line 1"):
        Manifest(tmp_path)


def test_what_still_holds(tmp_path, made):
    assert made.holds(tmp_path, "abc")
    assert not made.holds(tmp_path, "abd")
    assert not dataclasses.replace(made, status="failed").holds(tmp_path, "abc")
    for name in ("scan.ply", "relief.obj"):
        path = tmp_path / name
        before = path.read_bytes(), path.stat()
        path.write_bytes(b"xxxxx")
        assert not made.holds(tmp_path, "abc")
        path.unlink()
        assert not made.holds(tmp_path, "abc")
        path.write_bytes(before[0])
        os.utime(path, ns=(before[1].st_atime_ns, before[1].st_mtime_ns))
        assert made.holds(tmp_path, "abc")
    (tmp_path / "pictures" / "relief.png").unlink()
    assert not made.holds(tmp_path, "abc")


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


def test_a_note_without_its_relief_is_no_entry(tmp_path, made):
    open_notes(tmp_path).keep(made)
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


def test_the_last_word_on_an_input_counts(tmp_path, made):
    manifest = Manifest(tmp_path)
    manifest.add(failed("x"))
    manifest.add(failed(made.input))
    manifest.add(made)
    manifest.notes.keep(failed("y"))
    # As after a kill: the last line was not finished, and the notes are still there.
    with (tmp_path / "manifest.jsonl").open("a") as file:
        file.write('{"input": "y", "outp')
    again = Manifest(tmp_path)
    assert again.entries == {"x": failed("x"), made.input: made, "y": failed("y")}
    again.settle([made.input, "y", "unknown"])
    lines = (tmp_path / "manifest.jsonl").read_text().splitlines()
    assert [BatchEntry.from_line(line) for line in lines] == [made, failed("y"), failed("x")]


@pytest.mark.parametrize("content", [b"{}\n", b"my own list\n", b"\xff\xfe\n"])
def test_a_file_that_is_no_manifest_is_left_alone(tmp_path, content):
    path = tmp_path / "manifest.jsonl"
    path.write_bytes(content)
    with pytest.raises(FileError, match=r"manifest\.jsonl .*ove it away"):
        Manifest(tmp_path)
    assert path.read_bytes() == content
