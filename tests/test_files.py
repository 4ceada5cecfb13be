"""Files that appear whole or not at all: real signals, real limits, in processes of their own."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import open3d as o3d
import pytest

from o3d_relief import files as files_module
from o3d_relief.cli import main
from o3d_relief.errors import FileError
from o3d_relief.files import check_exists, check_folder, check_place, remove_files, write_bytes, write_files
from shapes import bust, to_mesh

POSIX = pytest.mark.skipif(os.name != "posix", reason="signals and limits of POSIX")


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "scene.ply"
    o3d.io.write_triangle_mesh(str(path), to_mesh(bust(20)))
    return path


def names(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*"))


def start(scene, output, *words, before=""):
    code = f"{before}\nfrom o3d_relief.cli import run\nrun()"
    command = [
        sys.executable,
        "-c",
        code,
        "make",
        str(scene),
        str(output),
        "-k",
        "8",
        "--no-in-order",
        *words,
    ]
    return subprocess.Popen(command, stderr=subprocess.PIPE, text=True)


CRAWL = """
import pathlib, sys, time

def crawl(self, data):
    print('writing', file=sys.stderr, flush=True)
    time.sleep(30)

pathlib.Path.write_bytes = crawl
"""
"""Code after which no file is written for half a minute: long enough for a signal on any machine."""


def limit_files(size):
    """Code after which no file may grow beyond size: what a full disk does, from one byte on."""
    return f"import resource; resource.setrlimit(resource.RLIMIT_FSIZE, ({size}, {size}))"


class TestPlaces:
    def test_missing_and_folder(self, tmp_path):
        with pytest.raises(FileError, match=r"no\.ply does not exist\."):
            check_exists(tmp_path / "no.ply")
        with pytest.raises(FileError, match="is a folder, not a file"):
            check_exists(tmp_path)

    def test_a_file_that_is_read_only_is_not_replaced(self, tmp_path, monkeypatch):
        path = tmp_path / "r.ply"
        path.write_text("precious")
        path.chmod(0o444)
        # root may write everywhere
        monkeypatch.setattr(os, "access", lambda place, mode: Path(place) != path)
        with pytest.raises(FileError, match=r"r\.ply cannot be written, it is read-only: choose another"):
            check_place(path)
        with pytest.raises(FileError, match="read-only"):
            write_bytes(path, b"other")
        assert path.read_text() == "precious"


OLD = {"m.mtl": b"old", "m.obj": b"old"}
NEW = {"m.png": b"new", "m.mtl": b"new", "m.obj": b"new"}


class TestInterruption:
    def interrupted(self, folder, line):
        """Write over old files; be interrupted before the given line. Return whether there were so many."""
        folder.mkdir()
        for name, content in OLD.items():
            (folder / name).write_bytes(content)
        passed = 0

        def trace(frame, event, _argument):
            nonlocal passed
            if frame.f_code.co_filename != files_module.__file__:
                return None
            passed += event == "line"
            if passed == line:
                sys.settrace(None)
                raise KeyboardInterrupt
            return trace

        before = sys.gettrace()
        sys.settrace(trace)
        try:
            write_files(folder / "m.obj", NEW)
        except KeyboardInterrupt:
            return True
        finally:
            sys.settrace(before)
        return False

    def test_at_every_line_leaves_all_old_or_all_new(self, tmp_path):
        seen, line = [], 1
        while self.interrupted(tmp_path / str(line), line):
            seen.append({path.name: path.read_bytes() for path in (tmp_path / str(line)).iterdir()})
            line += 1
        assert line > 30
        assert all(state in (OLD, NEW) for state in seen)
        assert OLD in seen
        assert NEW in seen


@POSIX
class TestSignals:
    @pytest.mark.parametrize(
        ("number", "stage"),
        [(signal.SIGINT, "scene"), (signal.SIGTERM, "trim")],
    )
    def test_at_a_stage(self, scene, tmp_path, number, stage):
        out = tmp_path / "r.obj"
        out.write_text("the last one")
        with start(scene, out, before=CRAWL) as process:
            told = ""
            for line in process.stderr:
                told += line
                if line.startswith(f"  {stage}"):
                    process.send_signal(number)
                    break
            told += process.stderr.read()
            assert process.wait() == 128 + number
        assert told.strip().splitlines()[-1] == "o3d-relief: interrupted; no file is left half-written."
        assert "Traceback" not in told
        assert names(tmp_path) == ["r.obj", "scene.ply"]
        assert out.read_text() == "the last one"

    def test_while_it_writes(self, scene, tmp_path):
        with start(scene, tmp_path / "r.ply", before=CRAWL) as process:
            for line in process.stderr:
                if line == "writing\n":
                    assert any(name.startswith(".o3d-relief-") for name in names(tmp_path))
                    process.send_signal(signal.SIGTERM)
                    break
            assert "interrupted" in process.stderr.read()
            assert process.wait() == 128 + signal.SIGTERM
        assert names(tmp_path) == ["scene.ply"]

    def test_while_it_starts(self, scene, tmp_path):
        with start(scene, tmp_path / "r.ply") as process:
            time.sleep(0.7)  # somewhere in the imports, on most machines
            process.send_signal(signal.SIGTERM)
        assert process.returncode in (-signal.SIGTERM, 128 + signal.SIGTERM)
        assert names(tmp_path) == ["scene.ply"]


@POSIX
class TestFullDisk:
    @pytest.mark.parametrize(("ending", "old"), [("obj", False), ("ply", True)])
    def test_output(self, scene, tmp_path, ending, old):
        out = tmp_path / f"r.{ending}"
        if old:
            out.write_text("the last one")
        with start(scene, out, before=limit_files(5000)) as process:
            told = process.communicate()[1]
        assert process.returncode == 2, told
        assert told.strip().splitlines()[-1].startswith(f"o3d-relief: error: {out} cannot be written: ")
        assert "Traceback" not in told
        assert names(tmp_path) == ([out.name] if old else []) + ["scene.ply"]
        assert not old or out.read_text() == "the last one"

    def test_report(self, scene, tmp_path):
        report = tmp_path / "report.json"
        before = "import o3d_relief.cli as cli, o3d_relief.files as files, errno\n"
        before += "def full(path, content): raise OSError(errno.ENOSPC, 'No space left on device')\n"
        before += "files._place = (lambda place: lambda folder, new: full(0, 0) if 'report.json' in new else "
        before += "place(folder, new))(files._place)"
        with start(scene, tmp_path / "r.ply", "--report", str(report), before=before) as process:
            told = process.communicate()[1]
        assert process.returncode == 2
        assert f"error: {report} cannot be written: No space left on device." in told
        assert names(tmp_path) == ["r.ply", "scene.ply"]  # the relief itself is whole


@POSIX
class TestNobodyListens:
    def test_a_broken_pipe_does_not_stop_the_work(self, scene, tmp_path):
        with start(scene, tmp_path / "r.ply") as process:
            process.stderr.close()
        assert process.returncode == 0
        assert names(tmp_path) == ["r.ply", "scene.ply"]

    def test_nor_does_a_closed_stream(self, scene, tmp_path, monkeypatch):
        monkeypatch.setattr(sys, "stderr", None)
        assert main(["make", str(scene), str(tmp_path / "r.ply"), "-k", "8"]) == 0


def test_no_memory_is_one_sentence(scene, tmp_path, monkeypatch, capsys):
    def greedy(*_arguments, **_options):
        raise MemoryError

    monkeypatch.setattr("o3d_relief.pipeline.make_relief", greedy)
    assert main(["make", str(scene), str(tmp_path / "r.ply")]) == 2
    assert capsys.readouterr().err.splitlines()[-1].startswith("o3d-relief: error: the memory is used up")
    assert names(tmp_path) == ["scene.ply"]


def test_files_are_removed(tmp_path):
    for name in ("a.obj", "a.mtl", "other.mtl"):
        (tmp_path / name).touch()
    remove_files(tmp_path / "a.obj", ["a.mtl", "a_0.png", "a.obj"])
    assert [path.name for path in tmp_path.iterdir()] == ["other.mtl"]
    (tmp_path / "folder").mkdir()
    with pytest.raises(FileError, match="folder cannot be removed: "):
        remove_files(tmp_path / "folder", [])


def test_folders_are_checked(tmp_path, monkeypatch):
    (tmp_path / "file").touch()
    check_folder(tmp_path)
    check_folder(tmp_path / "new" / "newer")
    monkeypatch.chdir(tmp_path)
    check_folder("new")
    assert names(tmp_path) == ["file"]
    with pytest.raises(FileError, match=r"^file is a file, not a folder: choose another place"):
        check_folder("file")
    with pytest.raises(FileError, match=r"folder file.new cannot be made, .*file is a file, not a folder"):
        check_folder(Path("file") / "new")
    with pytest.raises(FileError, match=r"The folder nnn.* cannot be made: "):
        check_folder(5000 * "n")
    monkeypatch.setattr(os, "access", lambda *_: False)  # root may write everywhere
    with pytest.raises(FileError, match=r"^The folder .* is read-only: choose another place"):
        check_folder(tmp_path)
    with pytest.raises(FileError, match=r"^The folder new cannot be made, .* is read-only: choose another"):
        check_folder("new")


def test_a_folder_on_a_drive_that_is_not_there(tmp_path, monkeypatch):
    monkeypatch.setattr(Path, "exists", lambda _: False)
    with pytest.raises(FileError, match=r"new cannot be made, there is no .*: choose another place"):
        check_folder(tmp_path / "new")


def test_pictures_that_cannot_be_written_are_refused_before_the_work(scene, capsys, monkeypatch):
    monkeypatch.setattr("o3d_relief.pipeline.make_relief", lambda *_, **__: pytest.fail("a relief was made"))
    stages = scene / "stages"
    assert main(["make", str(scene), str(scene.with_name("r.ply")), "--stages", str(stages)]) == 2
    assert f"The folder {stages} cannot be made, {scene} is a file" in capsys.readouterr().err
