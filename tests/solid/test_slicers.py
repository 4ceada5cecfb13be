"""Debian's slicers take the files without mending anything."""

import re
import shutil
import subprocess

import numpy as np
import pytest

from o3d_relief.params import ReliefParams
from o3d_relief.pipeline import make_relief
from o3d_relief.plate_params import PlateParams
from o3d_relief.scene.arrays import MeshArrays
from o3d_relief.scene.encode import encode_mesh
from o3d_relief.solid.formats import write_solid
from o3d_relief.solid.make import make_solid
from o3d_relief.workshop import work_on
from o3d_relief.workshop_params import MillParams, TileParams
from shapes import bust, to_mesh

# What --info says of a sound mesh; it has further lines where something was open, turned round or removed.
SOUND = {"number_of_facets", "manifold", "number_of_parts", "volume"} | {
    f"{what}_{axis}" for what in ("size", "min", "max") for axis in "xyz"
}
COMPLAINT = re.compile(r"repair|warning|error|unable|invalid|not manifold|open edge", re.IGNORECASE)


@pytest.fixture(params=["prusa-slicer", "slic3r"])
def slicer(request):
    return _command(request.param)


def _command(name):
    path = shutil.which(name)
    if path is None:
        pytest.skip(f"{name} is not installed (Debian's package of that name has it)")

    def run(*words):
        done = subprocess.run(
            [path, *map(str, words)], capture_output=True, text=True, timeout=300, check=False
        )
        told = "\n".join(
            line for line in (done.stdout + done.stderr).splitlines() if "StaticPrintConfigs" not in line
        )
        assert done.returncode == 0, told
        return told

    return run


@pytest.fixture(scope="module")
def made():
    relief = make_relief(to_mesh(bust(40)), ReliefParams(k=16))
    solid = make_solid(relief, PlateParams(width_mm=60, depth_mm=15, margin_mm=3))
    mill = MillParams(mm_per_pixel=0.3, tool_mm=2, draft_deg=5)
    work = work_on(solid, mill=mill, undercut_free=True, tiles=None)
    tiles = work_on(
        solid, mill=None, undercut_free=False, tiles=TileParams(width_mm=40, height_mm=100)
    ).tiling
    assert tiles.counts["pins"] > 0
    return {"solid": solid, "milled": work.solid, "tile": tiles.tiles[0].solid}


@pytest.mark.parametrize("kind", ["solid", "milled", "tile"])
@pytest.mark.parametrize("ending", ["3mf", "stl"])
def test_a_slicer_finds_nothing_to_mend(tmp_path, slicer, made, kind, ending):
    solid = made[kind]
    path = tmp_path / f"piece.{ending}"
    write_solid(path, solid)
    told = slicer("--info", path)
    values = dict(re.findall(r"^(\w+) *= *(\S+)", told, re.MULTILINE))
    assert set(values) == SOUND, told
    assert values["manifold"] == "yes"
    assert int(values["number_of_facets"]) == len(solid.faces)
    assert float(values["volume"]) == pytest.approx(solid.volume, rel=1e-5)
    sizes = [float(values[f"size_{axis}"]) for axis in "xyz"]
    np.testing.assert_allclose(sizes, solid.size, atol=0.001)  # millimetres


def test_a_slicer_tells_when_there_is_something_to_mend(tmp_path, made):
    run = _command("prusa-slicer")
    solid = made["solid"]
    path = tmp_path / "open.stl"
    opened = MeshArrays(vertices=solid.vertices, faces=solid.faces[20:])
    path.write_bytes(encode_mesh(opened, path.name)[path.name])
    told = run("--info", path)
    assert "manifold = no" in told
    assert "open_edges" in told


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["solid", "tile"])
@pytest.mark.parametrize("ending", ["3mf", "stl"])
@pytest.mark.parametrize("name", ["prusa-slicer", "slic3r"])
def test_a_slicer_slices_it_without_complaint(tmp_path, name, made, kind, ending):
    run = _command(name)
    solid = made[kind]
    path, code = tmp_path / f"piece.{ending}", tmp_path / "piece.gcode"
    write_solid(path, solid)
    words = ["--export-gcode"] if name == "prusa-slicer" else []
    told = run(*words, "--layer-height", "0.3", "--output", code, path)
    assert COMPLAINT.search(told) is None, told
    # Heights at which something is laid: the moves in x and y that follow have an E.
    layers = re.findall(
        r"^G1 Z([\d.]+)[^\n]*\n(?:(?!G1 Z)[^\n]*\n)*?G1 X\S+ Y\S+ E", code.read_text(), re.MULTILINE
    )
    assert max(map(float, layers)) == pytest.approx(solid.size[2], abs=0.35)
    assert len(set(layers)) == pytest.approx(solid.size[2] / 0.3, abs=3)
