import dataclasses
import json
from hashlib import sha256
from pathlib import Path

import numpy as np
import open3d as o3d
import pytest

import o3d_relief as rel
from o3d_relief.batch_manifest import Manifest, Notes
from o3d_relief.batch_recipe import BatchTask, Recipe
from o3d_relief.batch_task import run_task
from o3d_relief.bounds.certificate import Certificate
from shapes import bust, hills, sphere, to_mesh

RECIPE = Recipe(
    params=rel.ReliefParams(k=4, in_order=False),
    view=rel.View(),
    scan=rel.ScanParams(),
    ending=".ply",
    max_triangles=None,
)


RUN = "first"


@pytest.fixture
def task(tmp_path):
    scan = tmp_path / "ball.ply"
    o3d.io.write_triangle_mesh(str(scan), to_mesh(sphere(6)))
    (tmp_path / "pictures").mkdir()
    Notes(tmp_path, RUN).open()
    return BatchTask(
        input=str(scan),
        output="relief.ply",
        folder=str(tmp_path),
        recipe=RECIPE,
        digest=RECIPE.digest(),
        run=RUN,
    )


def begin_anew(folder):
    """Take all notes away, as the next batch does."""
    Notes(folder, RUN).remove()
    Notes(folder, RUN).open()


def test_a_relief_its_picture_and_its_entry(tmp_path, task):
    entry = run_task(task)
    assert entry.made
    expected = rel.make_relief(rel.read_mesh(task.input), RECIPE.params)
    assert entry.depth == np.asarray(expected.mesh.vertices)[:, 2].max()
    assert entry.triangles == len(expected.mesh.triangles)
    written = (tmp_path / "relief.ply").read_bytes()
    assert entry.certificate is None
    assert entry.output_sha256 == sha256(written).hexdigest()
    rel.write_mesh(tmp_path / "alone.ply", expected.mesh)
    assert written == (tmp_path / "alone.ply").read_bytes()
    assert entry.holds(tmp_path, RECIPE.digest())
    assert Notes(tmp_path, RUN).entry(task.input) == entry
    assert Notes(tmp_path, RUN).attempts(task.input) == 0
    assert run_task(task) == entry  # the first one counts, seconds and all


def test_a_certificate_where_it_is_asked_for(task, monkeypatch):
    entry = run_task(dataclasses.replace(task, recipe=dataclasses.replace(RECIPE, certificates=True)))
    expected = rel.make_relief(rel.read_mesh(task.input), RECIPE.params)
    assert entry.made
    assert entry.certificate == json.loads(json.dumps(expected.report()["certificate"]))

    def certify(**_arrays):
        raise AssertionError("A certificate is made.")

    monkeypatch.setattr("o3d_relief.relief.certify", certify)
    begin_anew(Path(task.folder))
    assert run_task(task).made
    begin_anew(Path(task.folder))
    strict = dataclasses.replace(task, recipe=dataclasses.replace(RECIPE, strict=True))
    assert "A certificate is made" in run_task(strict).error


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
    assert Notes(tmp_path, RUN).attempts(task.input) == 0


def test_strict_refuses_what_the_certificate_finds(tmp_path, task):
    params = rel.ReliefParams(k=64, in_front=False)
    o3d.io.write_triangle_mesh(task.input, to_mesh(bust(30)))
    loose = dataclasses.replace(RECIPE, params=params)
    entry = run_task(dataclasses.replace(task, recipe=dataclasses.replace(loose, strict=True)))
    assert entry.status == "failed"
    assert entry.error == f"relief.ply is not written (strict=True): {entry.failures[0]}"
    assert "visible vertices lie behind the plane" in entry.failures[0]
    assert not (tmp_path / "relief.ply").exists()
    assert Notes(tmp_path, RUN).entry(task.input) == entry
    noted = dataclasses.replace(loose, certificates=True)
    made = run_task(dataclasses.replace(task, recipe=noted))
    assert made.made
    assert made.certificate == entry.certificate  # refused or not, the same was measured


def test_everything_that_fails_is_told(task, monkeypatch):
    monkeypatch.setattr(Certificate, "failures", ["They are bent.", "They cross."])
    entry = run_task(dataclasses.replace(task, recipe=dataclasses.replace(RECIPE, strict=True)))
    assert entry.error == "relief.ply is not written (strict=True): They are bent. They cross."
    assert entry.failures == ("They are bent.", "They cross.")


def test_what_strict_refuses_is_removed_with_all_its_files(tmp_path, task):
    mesh = to_mesh(bust(30))
    mesh.triangle_uvs = o3d.utility.Vector2dVector(np.zeros((3 * len(mesh.triangles), 2)))
    mesh.triangle_material_ids = o3d.utility.IntVector([0] * len(mesh.triangles))
    mesh.textures = [o3d.geometry.Image(np.full((2, 2, 3), 99, np.uint8))]
    source = tmp_path / "in" / "bust.obj"
    source.parent.mkdir()
    rel.write_mesh(source, mesh)
    folder = tmp_path / "out"
    (folder / "pictures").mkdir(parents=True)
    Notes(folder, RUN).open()
    recipe = dataclasses.replace(RECIPE, params=rel.ReliefParams(k=64, in_front=False), ending=".obj")
    task = dataclasses.replace(
        task, input=str(source), output="r.obj", folder=str(folder), recipe=recipe, digest=recipe.digest()
    )
    assert run_task(task).made
    begin_anew(folder)
    files = {path.name for path in folder.rglob("*") if path.is_file()}
    assert files == {"r.obj", "r.mtl", "r_0.png", "r.png"}
    (folder / "other.ply").touch()
    refused = run_task(dataclasses.replace(task, recipe=dataclasses.replace(recipe, strict=True)))
    assert "r.obj is not written" in refused.error
    Notes(folder, RUN).remove()
    assert [path.name for path in folder.rglob("*") if path.is_file()] == ["other.ply"]


def test_a_file_that_has_cost_two_workers_is_not_begun_again(tmp_path, task):
    notes = Notes(tmp_path, RUN)
    notes.begin(task.input)
    assert run_task(task).attempts == 2  # once more is tried
    begin_anew(tmp_path)
    (tmp_path / "relief.ply").unlink()
    notes.begin(task.input)
    notes.begin(task.input)
    entry = run_task(task)
    assert not entry.made
    assert "was lost 2 times" in entry.error
    assert notes.attempts(task.input) == 0


@pytest.mark.parametrize("strict", [False, True])
def test_who_outlives_its_batch_writes_nothing_in_the_next_one(tmp_path, task, monkeypatch, strict):
    written = [tmp_path / "relief.ply", tmp_path / "pictures" / "relief.png"]
    for path in written:
        path.write_text("of the next batch")

    def make_relief(*arguments, **options):
        Manifest(tmp_path)  # another batch begins
        return made(*arguments, **options)

    made = rel.make_relief
    monkeypatch.setattr("o3d_relief.pipeline.make_relief", make_relief)
    monkeypatch.setattr(Certificate, "failures", ["They are bent."])
    for _ in range(2):  # at work when it begins, and called afterwards
        with pytest.raises(rel.FileError, match=r"notes of this batch have gone .* another batch has begun"):
            run_task(dataclasses.replace(task, recipe=dataclasses.replace(RECIPE, strict=strict)))
    assert [path.read_text() for path in written] == 2 * ["of the next batch"]
    assert list(tmp_path.rglob("*.json")) == list(tmp_path.rglob("*.begun")) == []
