import sys

import numpy as np
import open3d as o3d
import psutil
import pytest

import literal
import o3d_relief as rel
import speed
from o3d_relief.linalg.solve import solve_direct
from o3d_relief.stages.construction import construct
from shapes import bust, hills, to_mesh


def test_package_agrees_with_the_transcription():
    vertices, faces = hills(91)
    index, height = np.array([7, 4000, 60, 8000]), np.array([0.0, -3.0, 5.0, 2.0])
    by_hand = literal._solve(literal._laplacian(vertices, faces, areas=True), vertices[:, 2], height, index)
    laplacian, _ = rel.cotangent_laplacian(vertices, faces)
    built = construct(vertices, laplacian, index, height)
    assert by_hand == pytest.approx(built.z, abs=1e-6)


def test_table_has_a_row_for_everything_that_is_run(tmp_path, monkeypatch, capsys):
    path = tmp_path / "bust.ply"
    o3d.io.write_triangle_mesh(str(path), to_mesh(bust(12)))
    monkeypatch.setattr(speed, "direct_solver", lambda: ("SuperLU", solve_direct))
    options = ["--repeat", "2", "-k", "8", "--sizes", "1500"]
    monkeypatch.setattr(sys, "argv", ["speed.py", str(path), *options])
    speed.main()
    told = capsys.readouterr().out
    rows = [line.split("|")[1:-1] for line in told.split("GB per million")[1].splitlines() if "bust" in line]
    assert [row[2].strip() for row in rows] == ["package", "floor", "defaults", "bounded", "literal"] * 2
    for row in rows:
        assert float(row[4]) > 0.0
        if row[2].strip() == "floor":
            assert (float(row[5]), float(row[6])) == (1.0, 1.0)
    assert abs(int(rows[5][1].replace(",", "")) - 1500) < 300


def test_profile_names_the_functions_that_take_the_time():
    mesh = to_mesh(bust(40))
    rel.make_relief(mesh, rel.ReliefParams(k=8))  # what is imported at the first call is none of its time
    told = speed.profile(lambda: rel.make_relief(mesh, rel.ReliefParams(k=8)))
    cells = [[cell.strip() for cell in row.split("|")[1:-1]] for row in told[2:]]
    # What runs in threads beside, too. Not the outermost functions: Python 3.13 loses them.
    assert {"restoration_step.restoration_step", "bounds/columns.column_pairs"} <= {
        name for name, *_ in cells
    }
    whole = [float(seconds) for _, _, seconds, _ in cells]
    assert whole == sorted(whole, reverse=True)
    assert whole[-1] >= 0.0199 * whole[0] - 0.005


def test_ratios_are_taken_round_by_round():
    slow = [speed.Cost(wall, 1.0, 0.0) for wall in (2.0, 30.0, 8.0)]
    fast = [speed.Cost(wall, 1.0, 0.0) for wall in (1.0, 10.0, 2.0)]
    assert speed.ratio(slow, fast, lambda cost: cost.wall) == 3.0


def test_memory_is_the_peak_during_the_work():
    base = psutil.Process().memory_info().rss

    def work():
        block = np.ones(30_000_000)
        block.sum()
        return {}

    assert 0.1 < speed.timed(work, base).memory < 0.6
