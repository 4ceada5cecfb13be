import numpy as np
import pytest

from o3d_relief.bounds.grid import grid_pairs
from o3d_relief.bounds.lines import UP, Lines
from o3d_relief.bounds.pairs import close_pairs, vertex_pairs
from o3d_relief.rays import UnitBox
from shapes import grid, hills, joined, moved, sphere

_WALL = np.array([[-20.3, 3.1, -40], [20.3, 3.1, -40], [20.3, 3.1, -20], [-20.3, 3.1, -20.0]])
_SCENE = joined(
    hills(21),
    moved(grid(9, size=50.0), (0.37, 0.21, -30.0)),
    (_WALL, np.array([[0, 1, 2], [0, 2, 3]])),
    moved(sphere(12, 8.0), (0.11, 0.17, 40.0)),
)


def test_hits_are_the_nearest_faces_that_do_not_stand_upright():
    vertices, faces = _SCENE
    for box in (None, UnitBox(vertices, faces)):
        lines = Lines(vertices, faces, box)
        assert len(lines.faces) < len(faces)
        hits = lines.first(np.array([[1.3, 3.1, -35.0], [1.3, 3.1, 200.0]]), UP)
        assert hits.ray.tolist() == [0]
        at = np.einsum("kc,kcd->kd", hits.weights, vertices[lines.faces[hits.triangle]])
        assert at[0] == pytest.approx([1.3, 3.1, -30.0], abs=1e-4)
        assert hits.distance[0] == pytest.approx(5.0, abs=1e-4)


@pytest.mark.parametrize("find", [vertex_pairs, close_pairs, lambda lines: grid_pairs(lines, side=64)])
def test_a_box_of_all_faces_changes_nothing(find):
    vertices, faces = _SCENE
    one, other = find(Lines(vertices, faces)), find(Lines(vertices, faces, UnitBox(vertices, faces)))
    assert len(one) == len(other)
    assert np.sort(one.gap) == pytest.approx(np.sort(other.gap), abs=1e-4)
    for z in (vertices[:, 0], vertices[:, 1]):
        for pairs in (one, other):
            upper, lower = pairs.heights(z)
            assert upper == pytest.approx(lower, abs=1e-2)


def test_what_is_behind_a_rough_wall_is_found_without_listing_the_wall(monkeypatch):
    wall, faces = grid(40, size=60.0)
    rough = np.random.default_rng(0).normal(scale=1e-5, size=(2, len(wall)))
    upright = np.stack([0.8 * wall[:, 0] + rough[0], 0.5 * wall[:, 0] + rough[1], wall[:, 1]], axis=1)
    vertices, faces = joined((upright, faces), moved(grid(9, size=90.0), (0.37, 0.21, 40.0)))
    box = UnitBox(vertices, faces)
    lines = Lines(vertices, faces, box)
    first = box.above["primitive_ids"].numpy()[: len(wall)]
    assert (first < len(faces) - 2 * 8 * 8).mean() > 0.5  # most vertices meet the wall itself
    monkeypatch.setattr(Lines, "all", None)
    one, other = vertex_pairs(lines), vertex_pairs(Lines(vertices, faces))
    assert len(one) == len(other) > len(wall) / 2
    assert one.gap.sum() == pytest.approx(other.gap.sum(), rel=1e-6)
