"""Batches as they are run: in processes of their own, which are interrupted and killed."""

import json
import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import open3d as o3d
import pytest

import o3d_relief as rel
from shapes import bust, to_mesh

POSIX = pytest.mark.skipif(os.name != "posix", reason="signals and process groups of POSIX")
QUICK = ("-k", "4", "--no-in-order")


def write_balls(folder, count):
    """Write small meshes, no two alike; return their paths."""
    folder.mkdir(exist_ok=True)
    paths = [folder / f"ball_{number:02d}.ply" for number in range(count)]
    for number, path in enumerate(paths):
        ball = o3d.geometry.TriangleMesh.create_sphere(10.0 + number, 6)
        o3d.io.write_triangle_mesh(str(path), ball)
    return paths


def start(inputs, out, *words, path=None):
    """Start the command, as the leader of a process group."""
    command = [
        sys.executable,
        "-m",
        "o3d_relief",
        "batch",
        *map(str, inputs),
        "--out",
        str(out),
        *QUICK,
        *words,
    ]
    places = [str(path)] if path else []
    places += [os.environ["PYTHONPATH"]] if "PYTHONPATH" in os.environ else []
    environment = os.environ | ({"PYTHONPATH": os.pathsep.join(places)} if places else {})
    return subprocess.Popen(
        command, stderr=subprocess.PIPE, text=True, env=environment, start_new_session=True
    )


def finish(process):
    """Wait for the end of the command; return its exit code and what it said."""
    told = process.communicate(timeout=300)[1]
    assert "Traceback" not in told, told
    return process.returncode, told


def wait_for(process, out, count):
    """Wait until there are so many reliefs, with the command still at work."""
    limit = time.monotonic() + 240
    while len(list(out.glob("*.ply"))) < count:
        assert process.poll() is None, process.stderr.read()
        assert time.monotonic() < limit
        time.sleep(0.02)
    assert process.poll() is None


def wait_until(happened):
    limit = time.monotonic() + 120
    while not happened():
        assert time.monotonic() < limit
        time.sleep(0.02)


def contents(out):
    return {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}


def lines(out):
    return [json.loads(line) for line in (out / "manifest.jsonl").read_text().splitlines()]


def stamps(out):
    """What changes where a file is written again."""
    return {path.name: (path.stat().st_ino, path.stat().st_mtime_ns) for path in out.glob("*.ply")}


def hidden(out):
    return [path.name for path in out.rglob(".*")]


@pytest.mark.slow
@POSIX
def test_killed_and_taken_up_again(tmp_path):
    """40 inputs on two workers: ended by SIGTERM, all killed at once, finished; nothing is done twice."""
    inputs, out = write_balls(tmp_path / "in", 40), tmp_path / "out"
    process = start(inputs, out, "--jobs", "2")
    wait_for(process, out, 5)
    process.send_signal(signal.SIGTERM)
    code, told = finish(process)
    assert code == 128 + signal.SIGTERM
    assert told.splitlines()[-1] == "o3d-relief: interrupted; no file is left half-written."
    at_first = stamps(out)
    assert 5 <= len(at_first) < 40
    assert hidden(out) == []
    assert {line["output"] for line in lines(out)} == set(at_first)

    process = start(inputs, out, "--jobs", "2")
    wait_for(process, out, len(at_first) + 12)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    process.stderr.close()
    time.sleep(0.5)  # until the workers are gone, too
    at_last = stamps(out)
    assert len(at_first) + 12 <= len(at_last) < 40
    assert at_first.items() <= at_last.items()

    code, told = finish(start(inputs, out, "--jobs", "2"))
    assert code == 0
    assert f"40 reliefs, {len(at_last)} of them from an earlier run" in told
    everything = stamps(out)
    assert at_last.items() <= everything.items()  # nothing is done twice
    assert len(everything) == 40
    found = lines(out)
    assert [line["input"] for line in found] == [str(path) for path in inputs]
    assert all(line["status"] == "made" and line["error"] is None for line in found)
    for number, line in enumerate(found):
        assert line["output"] == f"ball_{number:02d}.ply"
        relief = rel.read_mesh(out / line["output"])
        assert line["depth"] == np.asarray(relief.vertices)[:, 2].max()
        assert line["triangles"] == len(relief.triangles)
    assert hidden(out) == []

    code, told = finish(start(inputs, out))
    assert code == 0
    assert "40 reliefs, 40 of them from an earlier run" in told
    assert stamps(out) == everything


@POSIX
def test_a_worker_outlives_its_batch(tmp_path):
    """Killed alone, a batch leaves its worker at work: it spoils nothing of the next one."""
    inputs, out = write_balls(tmp_path / "in", 1), tmp_path / "out"
    begun, go_on, ended = (tmp_path / name for name in ("begun", "go_on", "ended"))
    # Python runs this when it starts: who reads the input first waits, and tells when its task has ended.
    (tmp_path / "sitecustomize.py").write_text(
        "import pathlib, threading, time\n"
        "read = pathlib.Path.read_bytes\n"
        "def tell(place):\n"
        "    from o3d_relief.batch_task import _ALONE\n"
        "    with _ALONE:\n"
        "        (place / 'ended').touch()\n"
        "def read_bytes(self):\n"
        "    place = self.parents[1]\n"
        "    if self.parent.name == 'in' and not (place / 'begun').exists():\n"
        "        (place / 'begun').touch()\n"
        "        threading.Thread(target=tell, args=[place], daemon=True).start()\n"
        "        while not (place / 'go_on').exists():\n"
        "            time.sleep(0.01)\n"
        "    return read(self)\n"
        "pathlib.Path.read_bytes = read_bytes\n"
    )
    process = start(inputs, out, "--jobs", "1", path=tmp_path)
    try:
        wait_until(begun.exists)
        process.kill()
        process.wait()
        code, told = finish(start(inputs, out, "--jobs", "1", "--alpha", "0.5", path=tmp_path))
        assert code == 0, told
        before = contents(out)
        assert len(before) == 4
        go_on.touch()
        wait_until(ended.exists)
        assert contents(out) == before
    finally:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.stderr.close()


@pytest.mark.slow
def test_lost_workers_and_bad_files(tmp_path):
    """A worker that ends on one input is tried again, and then reported; the others are made."""
    inputs, out = write_balls(tmp_path / "in", 6), tmp_path / "out"
    for name in ("fatal", "fatal_once", "letter"):
        (tmp_path / "in" / f"{name}.ply").write_bytes(
            b"Dear sculptor" if name == "letter" else inputs[0].read_bytes()
        )
    # Python runs this when it starts: the process ends where it reads one of two files.
    (tmp_path / "sitecustomize.py").write_text(
        "import os, pathlib\n"
        "read = pathlib.Path.read_bytes\n"
        "def read_bytes(self):\n"
        "    once = self.with_name('was_here')\n"
        "    if self.parent.name == 'in' and self.name == 'fatal_once.ply' and not once.exists():\n"
        "        once.touch()\n"
        "        os._exit(9)\n"
        "    if self.parent.name == 'in' and self.name == 'fatal.ply':\n"
        "        os._exit(9)\n"
        "    return read(self)\n"
        "pathlib.Path.read_bytes = read_bytes\n"
    )
    others = (tmp_path / "in" / f"{name}.ply" for name in ("fatal", "fatal_once", "letter", "missing"))
    given = [*inputs[:3], *others, *inputs[3:]]
    code, told = finish(start(given, out, "--jobs", "2", path=tmp_path))
    assert code == 3
    found = {Path(line["input"]).stem: line for line in lines(out)}
    assert len(found) == 10
    assert {name for name, line in found.items() if line["status"] == "failed"} == {
        "fatal",
        "letter",
        "missing",
    }
    assert found["fatal"]["attempts"] == 2
    assert "The worker was lost 2 times" in found["fatal"]["error"]
    assert found["fatal_once"]["attempts"] == 2
    assert found["fatal_once"]["error"] is None
    assert "not a PLY file" in found["letter"]["error"]
    assert "does not exist" in found["missing"]["error"]
    assert "3 of 10 inputs failed" in told
    assert sorted(stamps(out)) == sorted(line["output"] for line in found.values() if line["error"] is None)
    assert hidden(out) == []
    # What failed is tried again, what is done is not.
    before = stamps(out)
    code, told = finish(start(given, out, "--jobs", "2"))
    assert code == 3
    assert "8 reliefs, 7 of them from an earlier run" in told
    assert before.items() <= stamps(out).items()


@pytest.mark.slow
@POSIX
def test_a_cluster_that_loses_a_machine(tmp_path):
    """A Dask scheduler and two workers, all processes of their own; one worker is killed in mid-run."""
    pytest.importorskip("distributed")
    inputs, out = write_balls(tmp_path / "in", 12), tmp_path / "out"
    file = tmp_path / "scheduler.json"
    at = ["--scheduler-file", str(file)]
    words = {
        "scheduler": [*at, "--port", "0", "--no-dashboard", "--host", "127.0.0.1"],
        "worker": [
            *at,
            "--nthreads",
            "1",
            "--no-nanny",
            "--no-dashboard",
            "--local-directory",
            str(tmp_path),
        ],
    }
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    cluster = [
        subprocess.Popen([sys.executable, "-m", "distributed.cli.dask_" + kind, *words[kind]], **quiet)
        for kind in ("scheduler", "worker", "worker")
    ]
    try:
        limit = time.monotonic() + 60
        while not file.exists() or not file.read_text().endswith("}"):
            assert time.monotonic() < limit
            time.sleep(0.1)
        address = json.loads(file.read_text())["address"]
        process = start(inputs, out, "--engine", "dask", "--scheduler", address)
        wait_for(process, out, 4)
        cluster[2].kill()
        code, told = finish(process)
        assert code == 0, told
        assert cluster[1].poll() is None
    finally:
        for one in cluster:
            one.kill()
            one.wait()
    assert [line["status"] for line in lines(out)] == ["made"] * 12
    assert len(stamps(out)) == 12
    assert sum(line["attempts"] for line in lines(out)) in (12, 13)  # the input that the lost worker had


@pytest.mark.slow
def test_ray(tmp_path):
    pytest.importorskip("ray")
    inputs, out = write_balls(tmp_path / "in", 4), tmp_path / "out"
    code, told = finish(start(inputs, out, "--engine", "ray", "--jobs", "2"))
    assert code == 0, told
    assert [line["status"] for line in lines(out)] == ["made"] * 4


def test_what_changed_is_made_again(tmp_path):
    """In this process, but for the workers: what the library returns and tells."""
    inputs, out = write_balls(tmp_path / "in", 3), tmp_path / "out"
    params = rel.ReliefParams(k=4, in_order=False)
    told, shares = [], []

    def run(params=params, **options):
        told.clear()
        shares.clear()
        return rel.make_reliefs(
            inputs, out, params, jobs=2, on_done=lambda entry: told.append(Path(entry.input).stem),
            on_progress=lambda stage, share: shares.append((stage, share)), **options,
        )  # fmt: skip

    batch = run()
    assert batch.already_done == 0
    assert batch.failed == ()
    assert sorted(told) == ["ball_00", "ball_01", "ball_02"]
    assert shares[0] == ("batch", None)
    assert [share for _, share in shares[1:]] == pytest.approx([0, 1 / 3, 2 / 3, 0.99, 1])
    assert batch.sheets == (out / "contact_sheet.png",)
    assert all(entry.output_sha256 for entry in batch.entries)

    assert run().already_done == 3
    assert told == []
    inputs[1].write_bytes(inputs[0].read_bytes())  # another scan
    (out / "ball_02.ply").write_bytes(b"ply, half of it")  # damaged
    assert run().already_done == 1
    assert sorted(told) == ["ball_01", "ball_02"]
    assert (out / "ball_01.ply").read_bytes() == (out / "ball_00.ply").read_bytes()
    assert run(rel.ReliefParams(k=5, in_order=False)).already_done == 0
    assert run(rel.ReliefParams(k=5, in_order=False), view=rel.View(front="x")).already_done == 0


def test_strict_makes_again_only_what_it_refuses(tmp_path):
    inputs, out = write_balls(tmp_path / "in", 2), tmp_path / "out"
    o3d.io.write_triangle_mesh(str(inputs[1]), to_mesh(bust(30)))
    params = rel.ReliefParams(k=48, in_front=False)  # which leaves some of the bust behind the plane

    def run(**options):
        return rel.make_reliefs(inputs, out, params, jobs=1, **options)

    assert [entry.certificate for entry in run().entries] == [None, None]
    batch = run(certificates=True)
    assert batch.already_done == 0
    assert [entry.certificate["visible_behind"] > 0 for entry in batch.entries] == [False, True]
    assert run(certificates=True).already_done == run().already_done == 2
    assert (out / "ball_01.ply").exists()
    sheet, before = (out / "contact_sheet.png").read_bytes(), stamps(out)
    batch = run(strict=True)
    assert batch.already_done == 1
    assert [entry.made for entry in batch.entries] == [True, False]
    assert "visible vertices lie behind the plane" in batch.failed[0].error
    assert lines(out)[1]["certificate"]["visible_behind"] > 0
    # What is refused is not there, nor is it to be seen.
    assert stamps(out) == {"ball_00.ply": before["ball_00.ply"]}
    assert [path.name for path in (out / "pictures").iterdir()] == ["ball_00.png"]
    assert (out / "contact_sheet.png").read_bytes() != sheet
    assert run().failed == ()
    assert (out / "contact_sheet.png").read_bytes() == sheet


def test_no_sheet_shows_what_is_refused(tmp_path):
    """Where it is all, and where the batch is called off."""
    inputs, out = write_balls(tmp_path / "in", 2), tmp_path / "out"
    for path in inputs:
        o3d.io.write_triangle_mesh(str(path), to_mesh(bust(30)))
    params = rel.ReliefParams(k=48, in_front=False)
    rel.make_reliefs(inputs, out, params, jobs=1)
    sheet = out / "contact_sheet.png"
    assert sheet.exists()
    with pytest.raises(rel.Cancelled):
        rel.make_reliefs(
            inputs, out, params, jobs=1, strict=True, on_progress=lambda _, share: (share or 0) < 0.3
        )
    assert not sheet.exists()
    sheet.touch()
    assert len(rel.make_reliefs(inputs, out, params, jobs=1, strict=True).failed) == 2
    assert not sheet.exists()


@pytest.mark.parametrize("name", ["strict", "certificates"])
def test_switches_are_checked(tmp_path, name):
    inputs, out = write_balls(tmp_path / "in", 1), tmp_path / "out"
    with pytest.raises(rel.ParameterError, match=f"{name} must be True or False"):
        rel.make_reliefs(inputs, out, **{name: 1})
    assert not out.exists()


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"params": {"k": 3}}, "params must be a ReliefParams"),
        ({"view": "z"}, "view must be a View"),
        ({"scan": {}}, "scan must be a ScanParams"),
    ],
)
def test_parameters_of_another_kind_are_refused_at_once(tmp_path, wrong, words):
    inputs, out = write_balls(tmp_path / "in", 1), tmp_path / "out"
    with pytest.raises(rel.ParameterError, match=words):
        rel.make_reliefs(inputs, out, **wrong)
    assert not out.exists()


def test_called_off(tmp_path):
    inputs, out = write_balls(tmp_path / "in", 6), tmp_path / "out"
    params = rel.ReliefParams(k=4, in_order=False)
    with pytest.raises(rel.Cancelled, match="in the stage batch"):
        rel.make_reliefs(inputs, out, params, jobs=2, on_progress=lambda _, share: (share or 0) < 0.3)
    kept = [line for line in lines(out) if line["status"] == "made"]
    assert 2 <= len(kept) < 6
    batch = rel.make_reliefs(inputs, out, params, jobs=2)
    assert len(kept) <= batch.already_done < 6
    assert [Path(entry.input).name for entry in batch.entries] == [path.name for path in inputs]
    assert hidden(out) == []


def test_a_folder_is_filled_by_one_batch_at_a_time(tmp_path):
    ours, theirs = write_balls(tmp_path / "ours", 1), write_balls(tmp_path / "theirs", 1)
    params, refused = rel.ReliefParams(k=4, in_order=False), []

    def meanwhile(_entry):  # the name is taken: both balls are called alike
        with pytest.raises(rel.FileError, match="Another batch is under way") as caught:
            rel.make_reliefs(theirs, tmp_path / "out", params, jobs=1)
        refused.append(caught.value)

    rel.make_reliefs(ours, tmp_path / "out", params, jobs=1, on_done=meanwhile)
    assert len(refused) == 1
    assert [entry["input"] for entry in lines(tmp_path / "out")] == [str(ours[0])]
    both = rel.make_reliefs(theirs, tmp_path / "out", params, jobs=1)
    assert [entry.output for entry in both.entries] == ["ball_00_2.ply"]
    assert hidden(tmp_path / "out") == []
