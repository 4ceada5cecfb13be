import sys

import numpy as np
import pytest

import ceiling
from o3d_relief.stages.visibility import visible_vertices
from quality import Scene
from shapes import bust


@pytest.fixture
def scene():
    vertices, faces = bust(24)
    return Scene(name="bust", vertices=vertices, faces=faces, visible=visible_vertices(vertices, faces))


def test_front_shows_the_normals_where_they_belong(scene):
    linear, best = ceiling.angles(scene, 0.25, 64)
    assert best[0] == pytest.approx(0.0, abs=0.01)
    assert linear[0] > 10.0
    assert (best[1:] > 1.0).all()  # right normals, wrong places


def test_whole_depth_has_nothing_to_win(scene):
    linear, best = ceiling.angles(scene, 1.0, 64)
    assert linear == pytest.approx(0.0, abs=0.1)
    assert best == pytest.approx(0.0, abs=0.1)


def test_what_is_behind_the_plane_is_not_seen(scene):
    body = ceiling.Body(scene.vertices - [0.0, 0.0, 1e3], scene.faces, np.zeros(2))
    reach = np.full(3, 100.0)
    assert body.shoot((20.0, 0.0), reach, 32).hit.any()
    assert not ceiling.in_front(body, (20.0, 0.0), reach, 32).hit.any()


def test_a_folder_without_a_manifest_is_named(monkeypatch, tmp_path):
    monkeypatch.setattr(sys, "argv", ["ceiling.py", str(tmp_path)])
    with pytest.raises(SystemExit, match=r"MANIFEST\.tsv does not exist"):
        ceiling.main()


def test_table_has_a_row_for_each_mesh_and_depth(monkeypatch, capsys, scene, tmp_path):
    monkeypatch.setattr(ceiling, "read_scene", lambda folder, name: scene)
    monkeypatch.setattr(sys, "argv", ["ceiling.py", str(tmp_path), "--meshes", "bust.ply", "--size", "32"])
    ceiling.main()
    table = capsys.readouterr().out
    assert "| bust | 25% |" in table
    assert "| bust | 10% |" in table
