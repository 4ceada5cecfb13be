import dataclasses
import json
from hashlib import sha256

import numpy as np
import open3d as o3d
import pytest

import o3d_relief as rel
from o3d_relief.batch_manifest import Notes
from o3d_relief.batch_task import BatchTask, Recipe, run_task
from shapes import bust, hills, sphere, to_mesh

RECIPE = Recipe(
    params=rel.ReliefParams(k=4, in_order=False),
    view=rel.View(),
    scan=rel.ScanParams(),
    ending=".ply",
    max_triangles=None,
)


@pytest.fixture
def task(tmp_path):
    scan = tmp_path / "ball.ply"
    o3d.io.write_triangle_mesh(str(scan), to_mesh(sphere(6)))
    (tmp_path / "pictures").mkdir()
    return BatchTask(
        input=str(scan), output="relief.ply", folder=str(tmp_path), recipe=RECIPE, digest=RECIPE.digest()
    )


def test_a_relief_its_picture_and_its_entry(tmp_path, task):
    entry = run_task(task)
    assert entry.made
    expected = rel.make_relief(rel.read_mesh(task.input), RECIPE.params)
    assert entry.depth == np.asarray(expected.mesh.vertices)[:, 2].max()
    assert entry.triangles == len(expected.mesh.triangles)
    written = (tmp_path / "relief.ply").read_bytes()
    assert entry.certificate == json.loads(json.dumps(expected.report()["certificate"]))
    assert entry.output_sha256 == sha256(written).hexdigest()
    rel.write_mesh(tmp_path / "alone.ply", expected.mesh)
    assert written == (tmp_path / "alone.ply").read_bytes()
    assert entry.holds(tmp_path, RECIPE.digest())
    assert Notes(tmp_path).entry(task.input) == entry
    assert Notes(tmp_path).attempts(task.input) == 0
    assert run_task(task) == entry  # the first one counts, seconds and all


def test_a_point_cloud_is_meshed(tmp_path, task):
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(hills(40)[0]))
    o3d.io.write_point_cloud(task.input, cloud)
    entry = run_task(task)
    assert entry.made
    assert entry.triangles > 1000


def test_what_is_wrong_is_said(tmp_path, task, monkeypatch):
    flat = dataclasses.replace(RECIPE, params=rel.ReliefParams(k=9999))
    entry = run_task(dataclasses.replace(task, recipe=flat))
    assert entry.status == "failed"
    assert "k must be at most the number of vertices" in entry.error
    assert entry.input_bytes > 0
    assert not (tmp_path / "relief.ply").exists()
    for error, sentence in (
        (MemoryError(), "memory is used up"),
        (KeyError("x"), "unexpected KeyError: 'x"),
    ):

        def broken(*_arguments, error=error, **_options):
            raise error

        monkeypatch.setattr("o3d_relief.pipeline.make_relief", broken)
        assert sentence in run_task(task).error
    assert Notes(tmp_path).attempts(task.input) == 0


def test_strict_refuses_what_the_certificate_finds(tmp_path, task):
    params = rel.ReliefParams(k=64, in_front=False)
    o3d.io.write_triangle_mesh(task.input, to_mesh(bust(30)))
    loose = dataclasses.replace(RECIPE, params=params)
    entry = run_task(dataclasses.replace(task, recipe=dataclasses.replace(loose, strict=True)))
    assert entry.status == "failed"
    assert entry.error == f"relief.ply is not written (strict): {entry.failures[0]}"
    assert "visible vertices lie behind the plane" in entry.failures[0]
    assert not (tmp_path / "relief.ply").exists()
    assert Notes(tmp_path).entry(task.input) == entry
    made = run_task(dataclasses.replace(task, recipe=loose))
    assert made.made
    assert made.certificate == entry.certificate  # refused or not, the same was measured


def test_strict_makes_the_same_reliefs():
    assert dataclasses.replace(RECIPE, strict=True).digest() == RECIPE.digest()


def test_a_file_that_has_cost_two_workers_is_not_begun_again(tmp_path, task):
    notes = Notes(tmp_path)
    notes.begin(task.input)
    assert run_task(task).attempts == 2  # once more is tried
    notes.remove()
    (tmp_path / "relief.ply").unlink()
    notes.begin(task.input)
    notes.begin(task.input)
    entry = run_task(task)
    assert not entry.made
    assert "was lost 2 times" in entry.error
    assert notes.attempts(task.input) == 0


@pytest.mark.parametrize(
    "change",
    [
        {"params": rel.ReliefParams(k=5, in_order=False)},
        {"view": rel.View(front="x")},
        {"scan": rel.ScanParams(max_hole=9.0)},
        {"ending": ".obj"},
        {"max_triangles": 10},
    ],
)
def test_every_part_of_the_recipe_counts(change):
    assert dataclasses.replace(RECIPE, **change).digest() != RECIPE.digest()
    assert dataclasses.replace(RECIPE).digest() == RECIPE.digest()
