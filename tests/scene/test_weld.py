import numpy as np

from o3d_relief.scene.weld import weld
from shapes import bust, exploded


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
