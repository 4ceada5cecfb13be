import importlib
import subprocess
import sys

import pytest

import o3d_relief
import o3d_relief as rel
from shapes import bust, to_mesh


@pytest.mark.parametrize("name", o3d_relief.__all__)
def test_every_public_name_exists_and_is_documented(name):
    assert getattr(o3d_relief, name).__doc__


def test_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'bas_relief'"):
        o3d_relief.bas_relief  # noqa: B018


def test_names_are_listed():
    assert set(o3d_relief.__all__) <= set(dir(o3d_relief))


def test_import_does_not_load_open3d():
    code = "import sys, o3d_relief; sys.exit('open3d' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_homes_are_the_modules_that_define_the_names():
    for name, home in o3d_relief._HOME.items():
        assert name in importlib.import_module(f"o3d_relief.{home}").__all__


@pytest.fixture(scope="module")
def made():
    relief = rel.make_relief(to_mesh(bust(8)), rel.ReliefParams(k=3))
    solid = rel.make_solid(relief)
    return {"relief": relief, "solid": solid, "field": rel.height_field(solid, 2.0)}


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda m: rel.make_relief(m["relief"].mesh, {"k": 3}), "params must be a ReliefParams"),
        (lambda m: rel.make_reliefs(["a.ply"], "out", {"k": 3}), "params must be a ReliefParams"),
        (lambda m: rel.make_reliefs(["a.ply"], "out", view="z"), "view must be a View"),
        (lambda m: rel.make_reliefs(["a.ply"], "out", scan=5), "scan must be a ScanParams"),
        (lambda m: rel.save_params("a.json", {"k": 3}), "params must be a ReliefParams"),
        (lambda m: rel.save_params("a.json", rel.ReliefParams(), "z"), "view must be a View"),
        (lambda m: rel.ReliefEditor(m["relief"].mesh, rel.ReliefParams(k=3)).change(view="z"), "be a View"),
        (lambda m: rel.check_solid(m["relief"], rel.PlateParams()), "be a Solid, as make_solid returns"),
        (lambda m: rel.check_solid(m["solid"], None), "params must be a PlateParams"),
        (lambda m: rel.write_solid("a.stl", m["relief"].mesh), "be a Solid, as make_solid returns"),
        (lambda m: rel.height_field(m["relief"], 2.0), "be a Solid, as make_solid returns"),
        (lambda m: rel.milled(m["solid"], rel.MillParams()), "be a HeightField, as height_field returns"),
        (lambda m: rel.milled(m["field"], None), "params must be a MillParams"),
        (lambda m: rel.solid_under(m["solid"], m["field"]), "be a HeightField, as height_field returns"),
        (lambda m: rel.solid_under(m["field"], None), "be a Solid, as make_solid returns"),
        (lambda m: rel.write_height_map("a.png", m["solid"]), "be a HeightField, as height_field returns"),
        (lambda m: rel.make_tiles(m["relief"], None), "be a Solid, as make_solid returns"),
        (lambda m: rel.make_tiles(m["solid"], rel.PlateParams()), "params must be a TileParams"),
        (lambda m: rel.show_stages(m["relief"].mesh), "be a Relief, as make_relief returns"),
    ],
)
def test_what_is_of_another_class_is_refused_in_a_sentence(made, tmp_path, monkeypatch, call, sentence):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(rel.ParameterError, match=sentence):
        call(made)
    assert list(tmp_path.iterdir()) == []
