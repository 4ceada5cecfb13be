import numpy as np
import pytest

from o3d_relief.stages.trim import trim_behind
from shapes import bust, grid


def _area(vertices, faces):
    a, b, c = vertices[faces].transpose(1, 0, 2)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2


def _trim(vertices, faces):
    return trim_behind(vertices, faces, np.ones(len(vertices), dtype=bool))


def test_tilted_square_is_cut_in_half():
    vertices, faces = grid(12, size=2.0)
    vertices[:, 2] = vertices[:, 0]
    cut = _trim(vertices, faces)
    assert _area(cut.vertices, cut.faces) == pytest.approx(_area(vertices, faces) / 2)
    assert (cut.vertices[:, 2] >= 0).all()


def test_cut_vertices_lie_exactly_on_the_plane_and_kept_ones_are_untouched():
    vertices, faces = bust(20)
    cut = _trim(vertices, faces)
    made = cut.source_index < 0
    assert made.any()
    assert (cut.vertices[made, 2] == 0.0).all()
    assert np.array_equal(cut.vertices[~made], vertices[cut.source_index[~made]])
    assert (np.diff(cut.source_index[~made]) > 0).all()


def test_cut_of_a_closed_body_is_one_clean_boundary():
    vertices, faces = bust(20)
    cut = _trim(vertices, faces)
    edges = np.sort(cut.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    edge, count = np.unique(edges, axis=0, return_counts=True)
    assert set(count) == {1, 2}
    assert (cut.vertices[edge[count == 1], 2] == 0.0).all()


def test_faces_keep_the_way_they_turn():
    vertices, faces = bust(20)
    vertices[:, 2] -= 3.7  # no vertex lies within rounding errors of the plane
    cut = _trim(vertices, faces)

    def normals(v, f):
        return np.cross(v[f[:, 1]] - v[f[:, 0]], v[f[:, 2]] - v[f[:, 0]])

    aligned = (normals(cut.vertices, cut.faces) * normals(vertices, faces)[cut.face_from]).sum(axis=1)
    assert (aligned > 0).all()


@pytest.mark.parametrize(
    ("z", "count"),
    [
        ((1, 1, 1), 1), ((0, 0, 0), 1), ((0, 0, 1), 1), ((0, 1, 1), 1),
        ((-1, -1, -1), 0), ((0, -1, -1), 0), ((0, 0, -1), 0),
        ((-1, 1, 1), 2), ((-1, -1, 1), 1), ((0, -1, 1), 1),
    ],
)  # fmt: skip
def test_every_case_of_one_triangle(z, count):
    for shift in range(3):
        vertices = np.array([[0, 0, 0], [3, 0, 0], [0, 3, 0.0]])
        vertices[:, 2] = np.roll(z, shift)
        if count == 0:
            assert len(_trim(vertices, np.array([[0, 1, 2]])).faces) == 0
        else:
            cut = _trim(vertices, np.array([[0, 1, 2]]))
            assert len(cut.faces) == count
            assert (cut.vertices[:, 2] >= 0).all()
            assert _area(cut.vertices, cut.faces) > 0


def test_values_are_carried_over():
    vertices = np.array([[0, 0, 3], [4, 0, -1], [0, 4, -3.0]])
    faces = np.array([[0, 1, 2]])
    cut = _trim(vertices, faces)
    values = cut.to_vertices(np.array([[0.0], [8.0], [10.0]]))[:, 0]
    assert sorted(values.tolist()) == [0.0, 5.0, 6.0]
    corners = cut.to_corners(faces, np.array([[[0.0, 1], [8, 1], [10, 1]]]))
    assert np.array_equal(corners[0, :, 0], values[cut.faces[0]])


def test_both_sides_of_a_seam_are_cut_at_the_same_place():
    vertices = np.array([[0, 0, 1], [1, 0.3, -0.7], [0, 5, 1], [0, 0, 1], [1, 0.3, -0.7], [0, -5, 1]])
    cut = _trim(vertices, np.array([[0, 1, 2], [4, 3, 5]]))
    made = cut.vertices[cut.source_index < 0]
    assert len(made) == 4
    assert len(np.unique(made, axis=0)) == 3


def test_unusable_vertices_go_with_their_faces():
    vertices, faces = grid(4)
    usable = np.ones(16, dtype=bool)
    usable[5] = False
    cut = trim_behind(vertices, faces, usable)
    assert 5 not in cut.source_index
    assert len(cut.faces) == (~(faces == 5).any(axis=1)).sum()


def test_nothing_in_front_leaves_nothing():
    vertices, faces = grid(4)
    assert len(_trim(vertices - [0, 0, 1], faces).faces) == 0
