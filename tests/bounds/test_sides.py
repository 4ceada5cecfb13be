import numpy as np
import pytest

import o3d_relief as rel
from o3d_relief import bounded_step
from o3d_relief.bounds.sides import SIDES, shown_normals, side_pull, smooth_pull, tilt_pull, vertex_masses
from o3d_relief.linalg.laplacian import cotangent_laplacian
from o3d_relief.measure import measure_relief
from shapes import bust, grid, joined, moved, sphere, to_mesh


def normals_of(vertices, faces):
    a, b, c = vertices[faces].transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    return normal / np.linalg.norm(normal, axis=1)[:, None]


def roof():
    """Two slopes of 45 degrees that meet above x = 0, at the height 50."""
    x, y = np.meshgrid([-50.0, -10, 0, 10, 50], [-100.0, 100], indexing="ij")
    vertices = np.column_stack([x.ravel(), y.ravel(), 50.0 - np.abs(x).ravel()])
    corner = np.arange(4)[:, None] * 2
    faces = np.concatenate([corner + np.array(three) for three in ([0, 2, 3], [0, 3, 1])])
    return vertices, faces


def test_a_scene_shows_itself_its_own_normals():
    vertices, faces = sphere(12)
    normals = normals_of(vertices, faces)
    chosen = np.flatnonzero(normals[:, 2] > 0.5)
    shown = shown_normals(vertices, faces, vertices[:, 2], chosen)
    assert np.cross(shown, normals) == pytest.approx(0.0, abs=1e-5)
    # From every side the middle of the front is seen; a side's own share is the cosine of its angle.
    best = chosen[normals[chosen, 2].argmax()]
    assert np.linalg.norm(shown[best]) == pytest.approx(
        np.cos(np.deg2rad([20, 20, 20, 20, 40, 40])).mean(), abs=0.02
    )
    others = np.setdiff1d(np.arange(len(faces)), chosen)
    assert (shown[others] == 0.0).all()


def test_a_flattened_ridge_is_shown_the_slope_beyond():
    vertices, faces = roof()
    near_ridge = np.flatnonzero(np.isin(vertices[faces, 0], [-10.0, 0.0]).all(axis=1))
    assert len(near_ridge) == 2
    shown = shown_normals(vertices, faces, np.full(len(vertices), 25.0), near_ridge)[near_ridge]
    left, right = np.array([[-1.0, 0, 1], [1, 0, 1]]) / np.sqrt(2.0)
    narrow, wide = np.cos(np.deg2rad([20.0, 40.0]))
    expected = ((narrow + wide) * right + (3 * narrow + wide) * left) / len(SIDES)
    assert shown == pytest.approx(np.tile(expected, (2, 1)), abs=1e-6)


def test_what_another_part_hides_is_not_shown_anything():
    low = grid(2, size=10.0)
    vertices, faces = joined(low, moved(grid(2, size=200.0), (0, 0, 20)))
    shown = shown_normals(vertices, faces, vertices[:, 2], np.arange(len(faces)))
    assert (shown[: len(low[1])] == 0.0).all()
    assert (shown[len(low[1]) :, 2] > 0.0).all()


def test_the_force_is_that_of_the_gradient():
    """A displacement d takes the sum of A m . grad d from the agreement of normals."""
    vertices, faces = sphere(10)
    random = np.random.default_rng(1)
    towards, slope = random.normal(size=(len(faces), 3)), np.array([0.3, -0.2, 0.5])
    normals, (a, b, c) = normals_of(vertices, faces), vertices[faces].transpose(1, 0, 2)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2.0
    along = slope - (normals @ slope)[:, None] * normals
    force = tilt_pull(vertices, faces, towards)
    assert force @ (vertices @ slope) == pytest.approx(-(area * (towards * along).sum(axis=1)).sum())
    assert force.sum() == pytest.approx(0.0, abs=1e-9)


def test_evening_out_spreads_a_force_and_loses_nothing_of_it():
    vertices, faces = joined(grid(20), moved(grid(20), (150, 0, 0)))
    half = len(vertices) // 2
    force = np.zeros(len(vertices))
    force[half // 2] = 1.0
    form, _ = cotangent_laplacian(vertices, faces)
    spread = smooth_pull(form, vertex_masses(vertices, faces, np.ones(len(faces))), force, 10.0)
    assert spread.min() >= -1e-12
    assert spread.max() < 0.2
    assert spread[:half].sum() == pytest.approx(1.0)
    assert spread[half:] == pytest.approx(0.0, abs=1e-12)


def test_what_does_not_count_is_not_pulled():
    vertices, faces = bust()
    seen = normals_of(vertices, faces)[:, 2] > 0.0
    weights = np.where(vertices[faces, 1].mean(axis=1) > 0.0, 1.0, 0.0)
    pull = side_pull(vertices, faces, 0.2 * vertices[:, 2], seen, weights, 0.2)
    idle = np.ones(len(vertices), dtype=bool)
    idle[faces[weights > 0.0]] = False
    assert idle.any()
    assert (pull[idle] == 0.0).all()
    assert np.abs(pull[~idle]).max() > 0.0


def test_a_deeper_relief_leans_more_within_limits():
    vertices, faces = bust()
    seen, weights = normals_of(vertices, faces)[:, 2] > 0.0, np.ones(len(faces))
    sizes = [
        np.linalg.norm(side_pull(vertices, faces, 0.2 * vertices[:, 2], seen, weights, share))
        for share in (0.05, 0.1, 0.2, 0.5, 0.9)
    ]
    assert np.array(sizes) / sizes[0] == pytest.approx([1.0, 1.0, 1.28, 1.6, 1.6])


def test_views_from_the_side_gain_and_the_front_hardly_loses(monkeypatch):
    mesh = to_mesh(bust())
    params = rel.ReliefParams(depth=20.0)
    leaning = measure_relief(mesh, rel.make_relief(mesh, params).mesh)
    monkeypatch.setattr(bounded_step, "side_pull", lambda vertices, *_: np.zeros(len(vertices)))
    plain = measure_relief(mesh, rel.make_relief(mesh, params).mesh)
    assert leaning.mean_angle < plain.mean_angle - 0.1
    assert leaning.normal_angles[0] < plain.normal_angles[0] + 0.5
