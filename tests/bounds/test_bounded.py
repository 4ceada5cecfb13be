import numpy as np
import pytest

from o3d_relief.bounds.bounded import closest_relief, lowest_seen
from o3d_relief.bounds.crossings import crossings, edges_of
from o3d_relief.bounds.grid import grid_pairs
from o3d_relief.bounds.lines import Lines
from o3d_relief.bounds.pairs import Pairs, vertex_pairs
from o3d_relief.bounds.rows import point_rows
from o3d_relief.bounds.seen import face_weights, seen_faces, seen_points
from o3d_relief.linalg import interior
from o3d_relief.linalg.laplacian import cotangent_laplacian
from o3d_relief.stages.visibility import visible_vertices
from shapes import bust, grid, hills, joined, moved


def no_rows(n):
    return point_rows(np.zeros((0, 3), dtype=np.int64), np.zeros((0, 3)), n)


def closest(shape, depth, *, attach=(), weights=None, min_gap=0.0):
    vertices, faces = shape
    n = len(vertices)
    visible = visible_vertices(vertices, faces)
    face, share = seen_points(vertices, faces, side=256)
    weight = face_weights(vertices, faces, seen_faces(faces, visible, face), 0.2)
    form, _ = cotangent_laplacian(vertices, faces, weights=weight if weights is None else weight * weights)
    partly = ~visible[faces[face]].all(axis=1)
    pairs = Pairs.join([vertex_pairs(Lines(vertices, faces)), grid_pairs(Lines(vertices, faces), side=256)])
    seen = point_rows(faces[face[partly]], share[partly], n)
    found = closest_relief(
        vertices,
        faces,
        form,
        depth,
        pairs,
        seen,
        visible,
        pull=np.zeros(n),
        min_gap=min_gap,
        attach=np.array(attach, dtype=np.int64),
    )
    return found, visible, form, pairs


@pytest.mark.parametrize("depth", [2.0, 15.0])
def test_depth_is_reached_and_nothing_seen_lies_behind(depth):
    shape = hills()
    found, visible, _, _ = closest(shape, depth)
    assert found.z.max() == pytest.approx(depth, rel=1e-12)
    assert found.z[visible].min() == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("depth", [5.0, 25.0])
def test_energy_is_below_that_of_linear_scaling(depth):
    shape = bust()
    found, visible, form, _ = closest(shape, depth)
    z = shape[0][:, 2]
    lowest = z[visible].min()
    linear = (z - lowest) * depth / (z.max() - lowest)

    def energy(heights):
        change = heights - z
        return change @ (form @ change)

    assert energy(found.z) < 0.8 * energy(linear)


@pytest.mark.parametrize("depth", [3.0, 25.0])
def test_order_is_kept_on_and_between_the_lines(depth):
    vertices, faces = bust()
    found, visible, _, _ = closest((vertices, faces), depth)
    relief = np.column_stack([vertices[:, :2], found.z])
    for pairs in (vertex_pairs(Lines(relief, faces)), grid_pairs(Lines(relief, faces))):
        upper, lower = pairs.heights(vertices[:, 2])
        assert (upper - lower > -1e-3).all()
        assert len(pairs) > 100
    met = crossings(relief, faces, edges_of(faces))
    assert not (met.pierced(found.z) & ~met.pierced(vertices[:, 2])).any()
    assert (found.z[visible] >= 0.0).all()


def test_step_keeps_both_its_levels_flat():
    # Two flat levels and a wall between them: nearly all depth comes from the wall.
    vertices, faces = grid(31)
    vertices[:, 2] = np.where(vertices[:, 0] > 1.0, 40.0, 0.0)
    found, _, _, _ = closest((vertices, faces), 10.0)
    high = vertices[:, 2] > 20.0
    assert found.z[high] == pytest.approx(10.0, abs=1.0)
    assert found.z[~high] == pytest.approx(0.0, abs=1.0)


def test_attached_vertices_lie_on_the_plane():
    shape = hills()
    chosen = [820, 840, 1200]
    free, _, _, _ = closest(shape, 12.0)
    assert (free.z[chosen] > 0.1).all()
    held, _, _, _ = closest(shape, 12.0, attach=chosen)
    assert (held.z[chosen] == 0.0).all()
    assert held.attached_missed == 0
    assert held.z.max() == pytest.approx(12.0)


def test_heavy_faces_keep_their_shape_better():
    vertices, faces = hills()
    middle = vertices[faces].mean(axis=1)
    heavy = (np.abs(middle[:, :2] - [15, 10]) < 15).all(axis=1)

    def change(found):
        form, _ = cotangent_laplacian(vertices, faces, weights=heavy.astype(float))
        displacement = found.z - vertices[:, 2]
        return displacement @ (form @ displacement)

    plain, _, _, _ = closest((vertices, faces), 10.0)
    kept, _, _, _ = closest((vertices, faces), 10.0, weights=np.where(heavy, 20.0, 1.0))
    assert change(kept) < 0.5 * change(plain)


def test_patches_come_as_close_as_single_vertices(monkeypatch):
    shape = bust(60)
    z = shape[0][:, 2]
    plain, _, form, _ = closest(shape, 20.0)
    monkeypatch.setattr(interior, "_LARGE", 1000)
    monkeypatch.setattr(interior, "_FIRST_PATCHES", 100)
    patched, visible, _, pairs = closest(shape, 20.0)

    def energy(found):
        return (found.z - z) @ (form @ (found.z - z))

    assert energy(patched) == pytest.approx(energy(plain), rel=0.03)
    assert patched.gap <= 0.03
    assert not np.array_equal(patched.z, plain.z)
    assert patched.z[visible].min() == pytest.approx(0.0, abs=1e-12)
    assert (pairs.difference(len(z)) @ patched.z > 0.0)[pairs.gap > 1e-2].all()


def test_many_parts_are_not_solved_in_patches(monkeypatch):
    plates = joined(
        grid(21), *[moved(grid(4, size=5), (x, y, 20)) for x in range(-40, 41, 16) for y in (-30, 0, 30, 40)]
    )
    monkeypatch.setattr(interior, "_LARGE", 10**6)
    plain, _, _, _ = closest(plates, 10.0)
    monkeypatch.setattr(interior, "_LARGE", 100)
    assert np.array_equal(closest(plates, 10.0)[0].z, plain.z)


def test_lowest_seen_counts_points_of_faces():
    z = np.array([1.0, 2.0, -4.0])
    rows = point_rows(np.array([[0, 1, 2]]), np.array([[0.25, 0.5, 0.25]]), 3)
    assert lowest_seen(z, rows, np.array([True, True, False])) == 0.25
    assert lowest_seen(z, no_rows(3), np.array([True, True, False])) == 1.0
