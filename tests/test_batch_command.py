import dataclasses
from pathlib import Path

import pytest

import o3d_relief as rel
from o3d_relief.batch_entry import BatchEntry
from o3d_relief.cli import main

MADE = BatchEntry(
    input="/a/x.ply",
    output="x.obj",
    status="made",
    seconds=1.25,
    depth=3.0,
    triangles=9,
    notes=("No uvs.",),
)
FAILED = BatchEntry(input="/a/y.ply", output="y.obj", status="failed", seconds=0, error="/a/y.ply is empty.")


def _run(monkeypatch, entries, *words):
    """Run the command without the work; return its exit code and what the library was asked for."""
    asked = {}

    def make_reliefs(inputs, out, params, **options):
        asked.update(options, inputs=inputs, out=out, params=params)
        for entry in entries:
            options["on_done"](entry)
        return rel.Batch(entries=tuple(entries), already_done=0, sheets=())

    monkeypatch.setattr("o3d_relief.batch.make_reliefs", make_reliefs)
    return main(["batch", "a.ply", "scans", "--out", "out", *words]), asked


@pytest.mark.parametrize(("entries", "code"), [([MADE], 0), ([MADE, FAILED], 3), ([FAILED], 2)])
def test_exit_codes_and_lines(monkeypatch, capsys, entries, code):
    assert _run(monkeypatch, entries)[0] == code
    told = capsys.readouterr().err
    assert ("/a/x.ply -> x.obj: 9 triangles, 3 deep, 1.2 s\n  No uvs.\n" in told) == (MADE in entries)
    assert ("failed: /a/y.ply is empty.\n" in told) == (FAILED in entries)
    assert (f"1 of {len(entries)} inputs failed: see out" in told) == (FAILED in entries)


def test_errors_name_options_as_they_are_typed(monkeypatch, capsys):
    entry = dataclasses.replace(FAILED, error="k must be at most 9: 3 triangles (max_triangles).")
    assert _run(monkeypatch, [entry])[0] == 2
    assert "failed: /a/y.ply: -k must be at most 9: 3 triangles (--max-triangles)." in capsys.readouterr().err


@pytest.mark.parametrize(
    ("source", "output", "error", "said"),
    [
        ("/a/depth.ply", "depth.ply", "depth.ply is not written.", "/a/depth.ply: depth.ply is not written."),
        ("/a/depth 1.ply", "depth 1.ply", "depth 1.ply is no.", "/a/depth 1.ply: depth 1.ply is no."),
        ("C:\\min_gap\\x.ply", "x.ply", "C:\\min_gap\\x.ply is empty.", "C:\\min_gap\\x.ply is empty."),
        ("/my min_gap s/x.ply", "x.ply", "/my min_gap s/x.ply is empty.", "/my min_gap s/x.ply is empty."),
        ("/my min_gap s/x.ply", "x.ply", "min_gap of x.ply", "/my min_gap s/x.ply: --min-gap of x.ply"),
        ("/x.ply", "x.ply", "x.ply is no (strict=True): A. B.", "/x.ply: x.ply is no (--strict): A. B."),
        ("/x.ply", "x.ply", "/x.ply: alpha_min, in/min_gap.ply", "/x.ply: --alpha-min, in/min_gap.ply"),
    ],
)
def test_names_of_files_are_no_options(monkeypatch, capsys, source, output, error, said):
    entry = dataclasses.replace(FAILED, input=source, output=output, error=error)
    assert _run(monkeypatch, [entry])[0] == 2
    assert f"failed: {said}\n" in capsys.readouterr().err


@pytest.mark.parametrize(("failures", "said"), [([], "clean\n"), (["Bent."], "fails\n  Bent.\n  No uvs.\n")])
def test_certificates_are_told(monkeypatch, capsys, failures, said):
    entry = dataclasses.replace(MADE, certificate={"failures": failures})
    assert _run(monkeypatch, [entry])[0] == 0
    assert f"3 deep, 1.2 s; certificate: {said}" in capsys.readouterr().err


def test_an_error_that_does_not_name_its_file(monkeypatch, capsys):
    entry = dataclasses.replace(FAILED, error="No triangles.")
    assert _run(monkeypatch, [entry])[0] == 2
    assert "failed: /a/y.ply: No triangles.\n" in capsys.readouterr().err


def test_every_option_arrives(tmp_path, monkeypatch):
    file = tmp_path / "p.json"
    rel.save_params(file, rel.ReliefParams(k=7, alpha=0.5), rel.View(front="-y", up="z"))
    words = ["--params", str(file), "--alpha", "0.75", "--jobs", "3", "--engine", "dask", "--scheduler", "tcp://h:1",
             "--format", "glb", "--max-triangles", "99", "--max-hole", "2", "--strict"]  # fmt: skip
    code, asked = _run(monkeypatch, [MADE], *words)
    assert code == 0
    assert asked["inputs"] == [Path("a.ply"), Path("scans")]
    assert asked["out"] == Path("out")
    assert asked["params"] == rel.ReliefParams(k=7, alpha=0.75)
    assert asked["view"] == rel.View(front="-y", up="z")
    assert asked["scan"].max_hole == 2.0
    names = ("jobs", "engine", "scheduler", "ending", "max_triangles", "strict", "certificates")
    assert [asked[name] for name in names] == [3, "dask", "tcp://h:1", ".glb", 99, True, False]
    assert _run(monkeypatch, [MADE])[1]["strict"] is False
    assert _run(monkeypatch, [MADE], "--certificates")[1]["certificates"] is True


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--jobs", "0"], "jobs must be a whole number, at least 1"),
        (["--scheduler", "tcp://h:1"], "scheduler is the address of a cluster"),
        (["-k", "0"], "k must be a whole number, at least 1"),
    ],
)
def test_wrong_options(tmp_path, capsys, words, sentence):
    (tmp_path / "a.ply").touch()
    assert main(["batch", str(tmp_path / "a.ply"), "--out", str(tmp_path / "out"), *words]) == 2
    assert sentence in capsys.readouterr().err


def test_a_folder_that_cannot_be_made(tmp_path, capsys):
    for name in ("a.ply", "out"):
        (tmp_path / name).touch()
    assert main(["batch", str(tmp_path / "a.ply"), "--out", str(tmp_path / "out")]) == 2
    assert f"{tmp_path / 'out'} is a file, not a folder" in capsys.readouterr().err


def test_inputs_that_are_not_there_leave_no_folder(tmp_path, capsys):
    assert main(["batch", str(tmp_path / "scans"), "--out", str(tmp_path / "out")]) == 2
    assert "scans: check the name" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_parameters_without_effect_are_named(monkeypatch, capsys):
    code, asked = _run(monkeypatch, [MADE], "--depth", "25%", "-k", "9")
    assert code == 0
    assert asked["params"] == rel.ReliefParams(k=9, depth="25%")
    assert "no attenuation points: -k" in capsys.readouterr().err
