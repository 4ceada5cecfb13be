import numpy as np
import open3d as o3d
import pytest
import scipy.sparse.linalg as sla

from o3d_relief import (
    Cancelled,
    MeshError,
    ParameterError,
    PointEdit,
    ReliefEditor,
    ReliefParams,
    View,
    make_relief,
    read_mesh,
)
from o3d_relief.linalg.cholesky import Cholesky
from o3d_relief.stages.compression import compress
from shapes import bust, exploded, hills, joined, moved, sphere, to_mesh

K = 24
EXTENT = 100.0


class _StopError(Exception):
    pass


def _constructed(mesh, params, view):
    """The heights of the pipeline after the construction, compressed as the preview is."""
    records = {}

    def stop_there(record):
        records[record.name] = record
        if record.name == "construction":
            raise _StopError

    with pytest.raises(_StopError):
        make_relief(mesh, params, view=view, on_stage=stop_there)
    z = records["construction"].z
    alpha = params.alpha
    if params.depth is not None:
        alpha = min(1.0, params.depth / records["scene"].unit / z.max())
    return z if alpha is None else compress(z, alpha=alpha, alpha_min=params.alpha_min)[1]


def _assert_right(editor, mesh):
    difference = editor.heights - _constructed(mesh, editor.params, editor.view)
    assert np.abs(difference).max() < 1e-6 * EXTENT


@pytest.fixture(scope="module")
def mesh():
    return to_mesh(bust(40))


@pytest.fixture
def editor(mesh):
    return ReliefEditor(mesh, ReliefParams(k=K))


PARTS = to_mesh(
    joined(
        bust(30),
        *(moved((0.15 * v, f), (30 * i - 45, 25 * i - 40, 58)) for i, (v, f) in enumerate([sphere(10)] * 4)),
    )
)


@pytest.mark.parametrize("scene", ["bust", "parts", "loose parts"])
def test_every_change_equals_the_recomputation(mesh, scene):
    mesh = mesh if scene == "bust" else PARTS
    editor = ReliefEditor(mesh, ReliefParams(k=K, in_order=scene != "loose parts"))
    _assert_right(editor, mesh)
    for values in (
        {"beta": 0.05},
        {"beta": [0.01 * (i + 1) for i in range(K)]},
        {"alpha": 0.7},
        {"alpha_min": 0.2},
        {"alpha": None, "alpha_min": None, "depth": 15.0, "mode": "attenuation"},
        {"discard_above": 0.5},
        {"discard_above": 0.35},
        {"attach_below": 0.1},
        {"discard_above": 1.0},
    ):
        editor.change(**values)
        _assert_right(editor, mesh)
    for values in ({"action": "attach"}, {"action": "scale", "beta": 0.02}, {"action": "discard"}):
        editor.edit([0, 3, 5, 8], **values)
        _assert_right(editor, mesh)
    editor.edit(2, beta=1.5)
    _assert_right(editor, mesh)
    editor.clear(range(6))
    _assert_right(editor, mesh)


def test_changes_of_what_the_points_depend_on(mesh, editor):
    vertex = int(editor.points.vertex[4])
    editor.edit(4, action="attach")
    for values in (
        {"k": 10},
        {"seed": 5},
        {"view": View(front="x", up="y", viewpoint=(0, 0, 400))},
        {"view": View(vanishing_point=(0, 0, -300)), "k": K},
    ):
        editor.change(**values)
        _assert_right(editor, mesh)
        assert editor.params.point_edits == (PointEdit(vertex=vertex, action="attach"),)


def test_the_relief_is_that_of_make_relief(tmp_path):
    mesh = to_mesh(bust(24))
    editor = ReliefEditor(mesh, ReliefParams(k=K))
    editor.change(beta=0.1, alpha=0.8)
    editor.edit([1, 2], beta=0.02)
    editor.edit(3, action="discard")
    editor.save(tmp_path / "params.json")
    names = []
    relief = editor.relief(on_stage=lambda stage: names.append(stage.name))
    expected = make_relief(mesh, editor.params, view=editor.view)
    assert names == list(expected.stages)
    assert np.asarray(relief.mesh.vertices).tobytes() == np.asarray(expected.mesh.vertices).tobytes()
    other = ReliefEditor(mesh, ReliefParams(k=3))
    other.load(tmp_path / "params.json")
    assert (other.params, other.view) == (editor.params, editor.view)
    assert other.heights.tobytes() == editor.heights.tobytes()
    assert other.undo()
    assert other.params.k == 3


def test_undo_redo_and_reset(editor):
    states = [(editor.params, editor.heights)]
    for change in (
        lambda: editor.change(beta=0.05),
        lambda: editor.edit([1, 2], action="attach"),
        lambda: editor.change(k=12),
    ):
        change()
        states.append((editor.params, editor.heights))
    for params, heights in states[-2::-1]:
        assert editor.undo()
        assert editor.params == params
        assert editor.heights.tobytes() == heights.tobytes()
    assert not editor.undo()
    for params, heights in states[1:]:
        assert editor.redo()
        assert editor.params == params
        assert editor.heights.tobytes() == heights.tobytes()
    assert not editor.redo()
    editor.reset()
    assert editor.params == states[0][0]
    assert editor.undo()
    assert editor.params == states[-1][0]
    editor.change(beta=0.3)
    assert not editor.redo()  # another way was taken


def test_what_is_continued_is_undone_at_once(editor):
    editor.change(alpha=0.9)
    for beta in (0.3, 0.4, 0.5):
        editor.change(beta=beta, continued=beta > 0.3)
    editor.edit(3, action="attach")
    editor.edit(4, action="attach", continued=True)
    assert editor.undo()
    assert editor.params.point_edits == ()
    assert editor.params.beta == 0.5
    assert editor.undo()
    assert editor.params.beta == 0.2
    assert editor.params.alpha == 0.9


def test_points_tell_what_they_do(mesh, editor):
    before = editor.points
    assert len(before.vertex) == len(before.beta) <= K
    assert not before.edited.any()
    input_vertices = np.asarray(mesh.vertices)
    frame = np.column_stack([before.position, np.ones(len(before.beta))]) @ editor.to_scene.T
    assert frame[:, :3] == pytest.approx(input_vertices[before.vertex], abs=1e-5)
    editor.edit([0, 1], action="attach", beta=0.7)
    editor.edit(1, action="discard")
    points = editor.points
    assert points.action[:2].tolist() == ["attach", "discard"]
    assert points.beta[:2].tolist() == [0.7, 0.7]
    assert np.flatnonzero(points.edited).tolist() == [0, 1]
    attached = points.action == "attach"
    assert points.new_position[attached, 2].min() >= 0.0
    assert (points.new_position[:, :2] == points.position[:, :2]).all()
    assert len(editor.params.point_edits) == 2  # two edits of one point are one
    editor.clear(1)
    assert np.flatnonzero(editor.points.edited).tolist() == [0]
    assert editor.points.action[1] == before.action[1]


def test_the_preview_as_a_mesh(mesh):
    vertices, faces = exploded(bust(20))
    editor = ReliefEditor(to_mesh((2.0 * vertices, faces)), ReliefParams(k=8))
    assert len(editor.vertices) == len(editor.heights) == len(editor.scene_vertices) < len(vertices)
    assert editor.vertices[:, 2] == pytest.approx(editor.heights * editor.unit)
    assert (editor.vertices[:, :2] == editor.scene_vertices[:, :2]).all()
    assert len(editor.faces) == len(faces)
    back = np.column_stack([editor.scene_vertices, np.ones(len(editor.heights))]) @ editor.to_scene.T
    assert back[editor.welded_index][:, :3] == pytest.approx(2.0 * vertices, abs=1e-4)
    with pytest.raises(ValueError, match="read-only"):
        editor.heights[0] = 1.0


def test_the_mesh_is_not_changed_and_not_shared():
    mesh = to_mesh(hills(21))
    before = np.array(mesh.vertices)
    editor = ReliefEditor(mesh, ReliefParams(k=8))
    assert (np.asarray(mesh.vertices) == before).all()
    expected = np.array(editor.relief().mesh.vertices)
    mesh.translate((5, 0, 0))
    mesh.scale(3.0, (0, 0, 0))
    assert (np.asarray(editor.relief().mesh.vertices) == expected).all()


def test_bounded_mode_has_a_preview_and_no_points(mesh, editor):
    editor.edit(2, action="attach")
    editor.change(depth=12.0)
    assert editor.params.bounded
    assert editor.vertices[:, 2].max() == pytest.approx(12.0)
    assert len(editor.points.beta) == 0
    with pytest.raises(ParameterError, match="no attenuation points"):
        editor.edit(0, action="attach")
    assert editor.undo()
    assert editor.points.edited.sum() == 1
    editor.change(depth="25%")
    assert editor.params.depth == "25%"
    assert editor.visible_depth < np.ptp(editor.scene_vertices[:, 2])
    assert editor.vertices[:, 2].max() == pytest.approx(0.25 * editor.visible_depth)
    editor.change(mode="attenuation")
    assert editor.vertices[:, 2].max() == pytest.approx(0.25 * editor.visible_depth)
    first = ReliefEditor(mesh, ReliefParams(depth=1e6))
    assert np.ptp(first.heights) == pytest.approx(np.ptp(first.scene_vertices[:, 2]) / first.unit)
    first.change(depth=None, k=K)
    _assert_right(first, mesh)


def test_errors_leave_everything_as_it_was(mesh, editor):
    editor.change(beta=0.1)
    params, heights = editor.params, editor.heights
    for wrong, words in (
        (lambda: editor.change(beta=-1), "beta must be at least 0"),
        (lambda: editor.change(betta=1), "'betta' is not a parameter"),
        (lambda: editor.change(beta=[1, 2]), "beta must be one number or one for each"),
        (lambda: editor.change(k=10**6), "k must be at most the number of vertices"),
        (lambda: editor.change(view=View(viewpoint=(0, 0, 1))), "viewpoint must lie in front"),
        (lambda: editor.edit(99, beta=1), "points must be between 0 and"),
        (lambda: editor.edit([-1], beta=1), "points must be between 0 and"),
        (lambda: editor.edit([0.5], beta=1), "points must be whole numbers"),
        (lambda: editor.edit([True], beta=1), "points must be whole numbers"),
        (lambda: editor.edit(0), "needs an action or a beta"),
        (lambda: editor.edit(0, action="release"), "action must be"),
        (lambda: editor.edit(range(len(editor.points.beta)), action="discard"), "leave at least one"),
    ):
        with pytest.raises(ParameterError, match=words):
            wrong()
        assert editor.params is params
        assert editor.heights is heights
    assert editor.undo()
    assert not editor.undo()


def test_a_long_change_is_told_of_and_called_off(mesh):
    told, stop = [], []

    def watch(stage, share):
        told.append((stage, share))
        return stage not in stop

    editor = ReliefEditor(mesh, ReliefParams(k=K), on_progress=watch)
    stages = list(dict.fromkeys(stage for stage, _ in told))
    assert stages == ["scene", "visibility", "weights", "clusters", "responses"]
    assert told[-1] == ("responses", 1.0)

    heights, told[:] = editor.heights, []
    editor.change(beta=0.3)
    assert not told  # at once
    editor.undo()
    for stage, change in (("responses", {"k": 9}), ("visibility", {"view": View(front="y", up="z")})):
        stop[:] = [stage]
        with pytest.raises(Cancelled, match=f"called off, in the stage {stage}"):
            editor.change(**change)
        assert (editor.params.k, editor.view) == (K, View())
        np.testing.assert_array_equal(editor.heights, heights)
    stop.clear()
    assert editor.redo()  # what is called off has not been a change
    editor.change(k=9)
    _assert_right(editor, mesh)


def test_what_the_editor_takes(mesh):
    with pytest.raises(MeshError, match="mesh_from_points"):
        ReliefEditor(o3d.geometry.PointCloud(mesh.vertices))
    with pytest.raises(ParameterError, match="params must be a ReliefParams"):
        ReliefEditor(mesh, View())
    with pytest.raises(ParameterError, match="view must be a View"):
        ReliefEditor(mesh, view="front")


def test_no_factorisation_where_the_points_stay(editor, monkeypatch):
    sizes = []
    factorise = sla.splu

    def told(matrix, **options):
        sizes.append(matrix.shape[0])
        return factorise(matrix, **options)

    class Told(Cholesky):
        def __init__(self, matrix, dissection):
            sizes.append(matrix.shape[0])
            super().__init__(matrix, dissection)

    monkeypatch.setattr(sla, "splu", told)
    monkeypatch.setattr("o3d_relief.linalg.factor.Cholesky", Told)
    monkeypatch.setattr(sla, "cg", None)
    editor.change(beta=0.05, alpha=0.9, discard_above=0.5)
    editor.edit([1, 2], action="discard")
    assert 0 < max(sizes) <= K  # Eq. 5, among the points
    editor.change(seed=2)
    assert max(sizes) > len(editor.heights) / 2


@pytest.mark.data
def test_a_scene_of_many_parts(data_folder):
    mesh = read_mesh(data_folder / "scene_japanese_temple.obj")
    editor = ReliefEditor(mesh, ReliefParams(k=64, beta=0.1))
    editor.change(beta=0.4)
    _assert_right(editor, mesh)
    editor.change(discard_above=0.35)  # other parts than before hold a point
    editor.edit(range(0, len(editor.points.beta), 5), action="scale", beta=0.05)
    _assert_right(editor, mesh)
