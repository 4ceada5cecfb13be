import sys

import edit
from o3d_relief import write_mesh
from shapes import bust, to_mesh


def test_a_row_for_each_size(tmp_path, capsys, monkeypatch):
    path = tmp_path / "scene.ply"
    write_mesh(path, to_mesh(bust(24)))
    words = ["edit.py", str(path), "--sizes", "600", "2400", "-k", "12", "--repeat", "2"]
    monkeypatch.setattr(sys, "argv", words)
    edit.main()
    lines = capsys.readouterr().out.splitlines()
    rows = [[float(cell) for cell in line.strip("|").split("|")] for line in lines[3:]]
    assert [row[0] for row in rows] == [602, 2402]
    assert all(len(row) == 5 + len(edit.CHANGES) for row in rows)
    assert all(row[3] > 0.0 for row in rows)
