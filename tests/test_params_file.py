import json

import numpy as np
import pytest

from o3d_relief import (
    FileError,
    ParameterError,
    PointEdit,
    ReliefParams,
    View,
    load_params,
    make_relief,
    save_params,
)
from shapes import bust, to_mesh

EVERYTHING = [
    (ReliefParams(), View()),
    (
        ReliefParams(
            k=7,
            beta=[0.1, 1 / 3, 0.2, 0.2, 0.2, 0.2, 0.7],
            alpha=0.7,
            alpha_min=0.1,
            min_gap=0.25,
            seed=3,
            point_edits=[PointEdit(vertex=4, action="discard"), PointEdit(vertex=9, beta=np.pi)],
        ),
        View(front="-y", up=(0, 0.1, 1), viewpoint=(0, 0, 900), vanishing_point=(0, 1e-3, -400)),
    ),
    (ReliefParams.paper(depth=12.3), View(front=(1, 2, 3))),
    (ReliefParams(depth=5, attach=[3, 1], weights=[1, 2.5, 1 / 7]), View()),
]


@pytest.mark.parametrize(("params", "view"), EVERYTHING)
def test_what_is_saved_is_loaded(tmp_path, params, view):
    path = tmp_path / "params.json"
    save_params(path, params, view)
    assert load_params(path) == (params, view)
    written = json.loads(path.read_text())["params"]
    assert set(written) == set(ReliefParams.__dataclass_fields__)  # defaults may change, files do not


@pytest.mark.parametrize(
    ("params", "view", "words"),
    [(View(), None, "params must be a ReliefParams"), (ReliefParams(), "z", "view must be a View")],
)
def test_nothing_else_is_saved(tmp_path, params, view, words):
    with pytest.raises(ParameterError, match=words):
        save_params(tmp_path / "params.json", params, view)
    assert not list(tmp_path.iterdir())


def test_a_small_file_by_hand(tmp_path):
    path = tmp_path / "params.json"
    path.write_text('\ufeff{"params": {"k": 9, "point_edits": [{"vertex": 2, "beta": 1}]}}', encoding="utf-8")
    assert load_params(path) == (ReliefParams(k=9, point_edits=[PointEdit(vertex=2, beta=1)]), View())
    path.write_text("{}")
    assert load_params(str(path)) == (ReliefParams(), View())


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[]", "the file must be an object"),
        ('{"parms": {}}', "'parms' is not known in the file: choose among o3d_relief, params, view"),
        ('{"params": [1]}', "params must be an object"),
        ('{"params": {"K": 3}}', "'K' is not known in params"),
        ('{"params": {"k": "3"}}', "k must be a whole number"),
        ('{"params": {"k": null}}', "k must be a whole number"),
        ('{"params": {"alpha": NaN}}', "alpha must be finite"),
        ('{"params": {"in_order": 1}}', "in_order must be True or False"),
        ('{"params": {"beta": {}, "k": 0}}', "k must be a whole number, at least 1"),
        ('{"params": {"alpha": 0.5, "depth": 3}}', "exclude each other"),
        ('{"params": {"point_edits": {}}}', "point_edits must be a list"),
        ('{"params": {"point_edits": [3]}}', "an edit must be an object"),
        ('{"params": {"point_edits": [{"beta": 3}]}}', 'an edit has no "vertex"'),
        ('{"params": {"point_edits": [{"vertex": 3, "depth": 1}]}}', "'depth' is not known in an edit"),
        ('{"view": {"front": "w"}}', "front must be x, -x"),
        ('{"view": {"side": "w"}}', "'side' is not known in view"),
    ],
)
def test_wrong_values_are_named(tmp_path, text, words):
    path = tmp_path / "params.json"
    path.write_text(text)
    with pytest.raises(ParameterError, match=words) as caught:
        load_params(path)
    assert str(caught.value).startswith(str(path))


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "not a parameter file in JSON"),
        (b"k = 3", "not a parameter file in JSON"),
        (b"\xff\xfe\x00", "not a parameter file in JSON: it is no text"),
        (b'{"params": {"k": 3, "k": 4}}', "'k' is given twice"),
        (b"[" * 100_000, "not a parameter file in JSON"),
    ],
)
def test_what_is_no_json_is_said(tmp_path, content, words):
    path = tmp_path / "params.json"
    path.write_bytes(content)
    with pytest.raises(FileError, match=words):
        load_params(path)


def test_a_report_is_named_and_what_to_take_of_it(tmp_path):
    path = tmp_path / "report.json"
    params = ReliefParams(k=3, point_edits=[PointEdit(vertex=0, action="attach")])
    report = make_relief(to_mesh(bust(8)), params, view=View(front="x")).report()
    path.write_text(json.dumps(report))
    with pytest.raises(FileError, match="is the report of a relief, not a parameter file: keep only its"):
        load_params(path)
    path.write_text(json.dumps({name: report[name] for name in ("params", "view")}))
    assert load_params(path) == (params, View(front="x"))


@pytest.mark.parametrize(
    "text", ['[{"k": 3}]', '{"asset": {}, "meshes": []}', '{"k": 64}', "solid x", '{"input": 1}\n{}']
)
def test_what_is_wanted_is_said(tmp_path, text):
    path = tmp_path / "other.json"
    path.write_text(text)
    with pytest.raises((FileError, ParameterError), match='wanted is an object with "params" and "view"'):
        load_params(path)


def test_a_long_value_is_cut(tmp_path):
    path = tmp_path / "params.json"
    path.write_text(json.dumps({"params": list(range(100_000))}))
    with pytest.raises(ParameterError, match=r"Got \[0, 1, 2, .*\.\.\.\] instead"):
        load_params(path)


def test_missing_files_and_folders(tmp_path):
    with pytest.raises(FileError, match="does not exist"):
        load_params(tmp_path / "nothing.json")
    with pytest.raises(FileError, match="is a folder"):
        load_params(tmp_path)
    with pytest.raises(FileError, match="cannot be written"):
        save_params(tmp_path / "missing" / "params.json", ReliefParams())
