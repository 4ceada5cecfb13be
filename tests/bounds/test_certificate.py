import json

import numpy as np
import open3d as o3d
import pytest

import o3d_relief as rel
from shapes import grid, joined, moved, sphere, to_mesh


def _comb(z, shift):
    vertices, faces = grid(21, size=90)
    return [moved((vertices * [0.12, 1, 1], faces), (x + shift, 0, z)) for x in range(-40, 41, 16)]


def _torus(turned):
    mesh = o3d.geometry.TriangleMesh.create_torus(30, 6, 40, 16)
    vertices = np.array(mesh.vertices)
    return (vertices[:, [0, 2, 1]] if turned else vertices), np.array(mesh.triangles, dtype=np.int64)


def _stairs():
    steps = []
    for i in range(24):
        vertices, faces = grid(5, size=24)
        tilted = vertices @ [[1, 0, 0], [0, 0.5, -0.87], [0, 0.87, 0.5]]
        angle = i * np.pi / 6
        steps.append(moved((tilted, faces), (30 * np.cos(angle), 4 * i, 30 * np.sin(angle))))
    return joined(*steps)


def _shards(count=500):
    """Triangles of all sizes and directions, many through each other."""
    rng = np.random.default_rng(5)
    corners = rng.uniform(-45, 45, (count, 1, 3)) + rng.normal(size=(count, 3, 3)) * 4
    return corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3)


SCENES = {
    "shards": joined(grid(31), moved(_shards(), (0, 0, 60))),
    "spiral staircase": _stairs(),
    "plate close behind plate": joined(
        grid(21), moved(grid(11, size=50), (0, 0, 20)), moved(grid(7, size=24), (0, 0, 20.001))
    ),
    "comb behind comb": joined(grid(31), *_comb(10, 0), *_comb(22, 8)),
    "interlocked rings": joined(_torus(False), moved(_torus(True), (30, 0, 0))),
    "thin shell": joined(sphere(24), sphere(24, radius=49.8)),
}


@pytest.mark.parametrize("name", SCENES)
def test_certificate_is_clean_on_awkward_scenes(name):
    relief = rel.make_relief(to_mesh(SCENES[name]), rel.ReliefParams(k=32))
    assert relief.certificate.failures == []
    assert relief.certificate.grid_pairs_tested > 0
    assert relief.stages["order"].counts["left"] == 0


def test_without_the_guarantees_the_certificate_says_what_is_wrong():
    paper = rel.make_relief(rel.demo_scene(), rel.ReliefParams.paper()).certificate
    assert paper.grid_inversions > 1000
    assert paper.visible_behind > 0
    assert any("changed places" in sentence for sentence in paper.failures)
    assert max(max(abs(place.x), abs(place.y)) for place in paper.places) <= 50
    behind = [place for place in paper.places if place.kind == "visible behind"]
    assert len(behind) == min(10, paper.visible_behind)
    assert all(place.upper < 0.0 for place in behind)


def test_minimum_gap_survives_compression():
    scene = to_mesh(SCENES["comb behind comb"])
    params = rel.ReliefParams(k=16, alpha=0.5, min_gap=1.0)
    certificate = rel.make_relief(scene, params).certificate
    assert certificate.gaps_tested > 1000
    assert certificate.gaps_missed == 0


def _plates(*, leaning=0.0):
    """Four plates in front of a large one; the frontmost may lean through the one behind it."""
    plates = [moved(grid(9, size=50), (0, 0, z)) for z in (10, 20, 30)]
    vertices, faces = moved(grid(8, size=44), (0, 0, 40))
    vertices[:, 2] += leaning * vertices[:, 0]
    return to_mesh(joined(grid(31), *plates, (vertices, faces)))


def test_contradicting_gaps_are_named_with_the_reason():
    params = rel.ReliefParams(depth=20.0, min_gap=7.0)
    relief = rel.make_relief(_plates(), params)
    certificate = relief.certificate
    assert certificate.gaps_missed > 1000
    (sentence,) = certificate.failures  # the large plate is hidden there, and cut off
    assert "the gaps asked for there, 3 x 7 = 21, do not fit into the relief's depth of 20" in sentence
    on_grid = certificate.places[:10]
    assert all(abs(place.x) <= 25.1 and abs(place.y) <= 25.1 for place in on_grid)
    assert all(0.0 < place.upper - place.lower < 7.0 for place in on_grid)
    written = json.loads(json.dumps(relief.report()))["certificate"]
    assert written["places"][0]["kind"] == "missed gap"
    assert "do not fit" in written["places"][0]["reason"]
    assert "do not fit" in written["failures"][0]


def test_what_crossed_in_the_scene_is_listed_and_no_failure():
    relief = rel.make_relief(_plates(leaning=0.6), rel.ReliefParams(k=16))
    certificate = relief.certificate
    assert certificate.failures == []
    assert certificate.old_crossings > 0
    old = [place for place in certificate.places if place.kind == "old crossing"]
    assert len(old) == min(10, certificate.old_crossings)
    for place in old:
        assert place.reason == "they crossed in the scene already"
        assert place.x == pytest.approx(-10 / 0.6, abs=1.0)  # where 40 + 0.6 x is 30
        assert place.lower == place.upper > 0.0
