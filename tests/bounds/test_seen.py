import numpy as np
import pytest

from o3d_relief.bounds.rows import point_rows
from o3d_relief.bounds.seen import face_weights, seen_faces, seen_points
from shapes import grid, joined, moved, sphere


def test_only_the_front_is_seen():
    vertices, faces = joined(grid(5), moved(grid(3, size=200.0), (0, 0, -10)))
    face, weights = seen_points(vertices, faces, side=64)
    inside = np.abs(np.einsum("qk,qkx->qx", weights, vertices[faces[face]])[:, :2]).max(axis=1) < 49.0
    assert (face[inside] < 32).all()
    assert weights.sum(axis=1) == pytest.approx(1.0)
    assert (weights >= 0.0).all()


def test_a_face_is_seen_by_a_vertex_or_a_point():
    faces = np.array([[0, 1, 2], [2, 3, 4], [4, 5, 6]])
    visible = np.array([True, False, False, False, False, False, False])
    assert seen_faces(faces, visible, np.array([2, 2])).tolist() == [True, False, True]


def test_weights_are_those_of_the_slopes():
    # A level face, one at 60 degrees (n_z = 1/2), an upright one, and one that is hidden.
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, np.sqrt(3.0)], [0, 0, 1.0]])
    faces = np.array([[0, 1, 2], [0, 3, 2], [0, 4, 2], [0, 1, 2]])
    seen = np.array([True, True, True, False])
    for share, steepest in ((0.5, 0.3), (0.1, 0.4)):
        expected = [*np.hypot([1.0, 0.5, 0.0], steepest), 0.05]
        assert face_weights(vertices, faces, seen, share) == pytest.approx(expected)


def test_rows_give_the_heights_of_points():
    vertices, faces = sphere(8)
    face, weights = seen_points(vertices, faces, side=16)
    heights = point_rows(faces[face], weights, len(vertices)) @ vertices[:, 2]
    assert heights == pytest.approx(np.einsum("qk,qk->q", weights, vertices[faces[face], 2]))
