import numpy as np

from o3d_relief.scene.winding import wrongly_wound
from shapes import bust, grid, joined, moved, sphere


def turned(faces, chosen):
    return np.where(chosen[:, None], faces[:, [0, 2, 1]], faces)


def test_finds_exactly_what_was_turned():
    vertices, faces = bust(16)
    for share, seed in ((0.0, 0), (0.01, 1), (0.3, 2), (0.45, 3)):
        chosen = np.random.default_rng(seed).random(len(faces)) < share
        assert np.array_equal(wrongly_wound(vertices, turned(faces, chosen)), chosen)


def test_the_larger_area_is_right():
    vertices, faces = grid(9)
    chosen = np.random.default_rng(5).random(len(faces)) < 0.8
    assert np.array_equal(wrongly_wound(vertices, turned(faces, chosen)), ~chosen)


def test_each_patch_by_itself():
    vertices, faces = joined(sphere(8), moved(sphere(8), (200, 0, 0)))
    chosen = np.arange(len(faces)) >= len(faces) // 2  # one sphere inside out: its own majority
    assert not wrongly_wound(vertices, turned(faces, chosen)).any()
    chosen[[0, 1, -1]] ^= True
    assert np.flatnonzero(wrongly_wound(vertices, turned(faces, chosen))).tolist() == [0, 1, len(faces) - 1]


def test_edges_of_three_faces_are_no_neighbours():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1.0]])
    faces = np.array([[0, 1, 2], [0, 1, 3], [0, 1, 4]])
    assert not wrongly_wound(vertices, faces).any()


def test_a_moebius_strip_is_left_alone():
    n = 20
    angle = np.arange(n) * 2 * np.pi / n
    middle = np.stack([10 * np.cos(angle), 10 * np.sin(angle), np.zeros(n)], axis=1)
    across = np.stack(
        [np.cos(angle) * np.cos(angle / 2), np.sin(angle) * np.cos(angle / 2), np.sin(angle / 2)], axis=1
    )
    vertices = np.concatenate([middle - across, middle + across])
    i = np.arange(n)
    low, high = np.append(i[1:], n), np.append(n + i[1:], 0)  # the end meets the start upside down
    faces = np.concatenate([np.stack([i, low, n + i], 1), np.stack([low, high, n + i], 1)])
    assert not wrongly_wound(vertices, faces).any()


def test_even_halves_and_faces_without_area_end_in_some_order():
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])
    for points in (square, square * 0.0):
        wrong = wrongly_wound(points, np.array([[0, 1, 2], [0, 3, 2]]))
        assert wrong.sum() == 1


def test_one_face():
    assert not wrongly_wound(np.eye(3), np.array([[0, 1, 2]])).any()
