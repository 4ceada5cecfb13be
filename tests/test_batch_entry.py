import dataclasses
import os

import pytest

from o3d_relief.batch_entry import BatchEntry


def test_a_line_says_all(made_entry):
    assert made_entry.failures == ("2 lie behind.",)
    assert dataclasses.replace(made_entry, certificate=None).failures == ()
    line = made_entry.line()
    assert line.endswith("}\n")
    assert line.count("\n") == 1
    assert BatchEntry.from_line(line) == made_entry


@pytest.mark.parametrize("line", ["", "{}", "[1]", "3", '{"input": "a"}', '{"notes": [], "other": 3}', "{"])
def test_other_lines_are_refused(line):
    with pytest.raises(ValueError, match=r"line of a batch|Expecting"):
        BatchEntry.from_line(line)


@pytest.mark.parametrize("certificate", [{}, 5, [], {"failures": None}, {"failures": "x"}, {"failures": [1]}])
def test_other_certificates_are_refused(made_entry, certificate):
    line = dataclasses.replace(made_entry, certificate=certificate).line()
    with pytest.raises(ValueError, match="not a line of a batch"):
        BatchEntry.from_line(line)


def test_what_still_holds(tmp_path, made_entry):
    assert made_entry.holds(tmp_path, "abc")
    assert not made_entry.holds(tmp_path, "abd")
    assert not dataclasses.replace(made_entry, status="failed").holds(tmp_path, "abc")
    for name in ("scan.ply", "relief.obj"):
        path = tmp_path / name
        before = path.read_bytes(), path.stat()
        path.write_bytes(b"xxxxx")
        assert not made_entry.holds(tmp_path, "abc")
        path.unlink()
        assert not made_entry.holds(tmp_path, "abc")
        path.write_bytes(before[0])
        os.utime(path, ns=(before[1].st_atime_ns, before[1].st_mtime_ns))
        assert made_entry.holds(tmp_path, "abc")
    (tmp_path / "pictures" / "relief.png").unlink()
    assert not made_entry.holds(tmp_path, "abc")
