import numpy as np
import pytest

from o3d_relief.scene.weld import SEAM, first_of_equal_rows, same_places, weld
from shapes import bust, exploded, grid, joined, moved


def test_exploded_mesh_is_joined_again():
    vertices, faces = bust(12)
    whole = weld(*exploded((vertices, faces)))
    assert len(whole.vertices) == len(np.unique(vertices, axis=0))
    assert len(whole.faces) == len(faces)
    assert np.array_equal(whole.vertices[whole.faces], vertices[faces])
    assert whole.merged_vertices == 3 * len(faces) - len(whole.vertices)


def test_clean_mesh_keeps_its_numbers():
    vertices, faces = bust(12)
    whole = weld(vertices, faces)
    assert np.array_equal(whole.index, np.arange(len(vertices)))
    assert np.array_equal(whole.faces, faces)
    assert (whole.merged_vertices, whole.degenerate_faces, whole.duplicate_faces) == (0, 0, 0)


def test_degenerate_duplicate_and_unreferenced_are_set_aside():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 0], [7, 7, 7], [5, 5, 5.0]])
    faces = np.array([[0, 1, 2], [2, 1, 3], [0, 3, 1], [1, 1, 2], [4, 4, 4]])
    whole = weld(vertices, faces)
    assert whole.faces.tolist() == [[0, 1, 2]]
    assert whole.index.tolist() == [0, 1, 2, 0, -1, -1]
    assert whole.duplicate_faces == 1
    assert whole.degenerate_faces == 3
    assert whole.unreferenced_vertices == 2
    assert np.array_equal(whole.vertices[whole.index[:4]], vertices[:4])


def test_input_survives():
    vertices, faces = bust(12)
    vertices.flags.writeable = faces.flags.writeable = False
    weld(vertices, faces)


def test_every_input_face_names_its_welded_face():
    vertices, faces = bust(8)
    chosen = np.array([0, 5, 0, 7])
    both = np.concatenate([faces, faces[chosen][:, ::-1], [[3, 3, 4]]])
    whole = weld(vertices, both)
    assert np.array_equal(whole.face_index, np.concatenate([np.arange(len(faces)), chosen, [-1]]))


@pytest.mark.parametrize("shift", [0.3, 0.9])
def test_sides_of_a_seam_are_joined_up_to_the_tolerance(shift):
    left, right = grid(5, size=4.0), moved(grid(5, size=4.0), (4.0 + shift * SEAM, 0, 0))
    vertices, faces = joined(left, right)
    whole = weld(vertices, faces)
    assert whole.merged_vertices == 5
    assert len(whole.vertices) == 45
    assert np.abs(whole.vertices[whole.index] - vertices).max() <= SEAM
    # The smaller coordinates stand for both, whichever half comes first.
    again = weld(*joined(right, left))
    assert sorted(again.vertices.tolist()) == sorted(whole.vertices.tolist())


def test_wider_gaps_and_inner_vertices_stay():
    vertices, faces = joined(grid(5, size=4.0), moved(grid(5, size=4.0), (4.0 + 1.1 * SEAM, 0, 0)))
    assert weld(vertices, faces).merged_vertices == 0
    # Only the rims of layers that nearly touch are one, not what lies inside them.
    vertices, faces = joined(grid(5, size=4.0), moved(grid(5, size=4.0), (0, 0, 0.5 * SEAM)))
    assert weld(vertices, faces).merged_vertices == 16


def test_fine_closed_surfaces_are_not_touched():
    vertices, faces = bust(12)
    tiny = vertices * 1e-6
    assert np.array_equal(same_places(tiny, faces), same_places(vertices, faces))


def test_nothing():
    assert len(weld(np.zeros((3, 3)), np.array([[0, 1, 2]])).faces) == 0
    assert same_places(np.zeros((0, 3)), np.zeros((0, 3), dtype=int)).shape == (0,)


@pytest.mark.parametrize("columns", [1, 2, 3])
@pytest.mark.parametrize("kind", [np.float64, np.int64])
def test_equal_rows_are_found_as_by_comparing_all_of_them(columns, kind):
    generator = np.random.default_rng(columns)
    for count in (1, 2, 7, 40):
        for values in (1, 2, 5, 1000):
            rows = generator.integers(-values, values + 1, size=(count, columns)).astype(kind)
            if kind is np.float64:
                rows[::2] *= -1.0  # makes some of the zeros -0.0, which equals 0.0
            equal = (rows[:, None] == rows[None]).all(axis=2)
            np.testing.assert_array_equal(first_of_equal_rows(rows), equal.argmax(axis=1))
