import numpy as np
import pytest

from o3d_relief.bounds.columns import column_pairs
from o3d_relief.bounds.grid import grid_pairs
from o3d_relief.bounds.lines import Lines
from o3d_relief.scene.demo import demo_scene
from shapes import grid, joined, moved


def test_columns_join_neighbours_on_a_line_only():
    lines = Lines(*joined(grid(5), moved(grid(5), (0, 0, 4)), moved(grid(5), (0, 0, 20))))
    pairs = column_pairs(lines, side=32)
    assert len(pairs) == 2 * 32 * 32
    assert sorted(set(np.round(pairs.gap).astype(int))) == [4, 16]


def test_columns_and_rays_find_the_same():
    mesh = demo_scene()
    lines = Lines(np.asarray(mesh.vertices) * 37.0, np.asarray(mesh.triangles, dtype=np.int64))
    found, cast = column_pairs(lines, side=101), grid_pairs(lines, side=101)
    assert len(found) == pytest.approx(len(cast), abs=2)  # a ray in float32 may pass beside an edge
    assert len(found) > 5000
    assert np.sort(found.gap).sum() == pytest.approx(np.sort(cast.gap).sum(), rel=1e-3)


def test_columns_meet_steep_triangles_exactly():
    vertices, faces = grid(9)
    steep = np.column_stack([vertices[:, :2] + 1e3 / 7, 50.0 * vertices[:, 0]])
    others, other_faces = grid(8)
    above = np.column_stack([others[:, :2] + 1e3 / 7, 50.0 * others[:, 0] + 3.0])
    pairs = column_pairs(Lines(*joined((steep, faces), (above, other_faces))), side=37)
    assert len(pairs) == 37 * 37
    assert pairs.gap == pytest.approx(3.0, abs=1e-9)


def test_columns_of_nothing_but_upright_triangles_are_empty():
    wall = np.array([[0.0, 0, 0], [0, 9, 0], [0, 0, 9], [0, 9, 9]])
    assert len(column_pairs(Lines(wall, np.array([[0, 1, 2], [1, 3, 2]])), side=8)) == 0
