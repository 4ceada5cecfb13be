import numpy as np
import pytest

from o3d_relief.scan.orientation import away_votes, edge_agreement, propagate, towards

FRONT, UP = np.array([0.0, 0, 1]), np.array([0.0, 1, 0])


def ball(count=3000, seed=0):
    points = np.random.default_rng(seed).normal(size=(count, 3))
    return points / np.linalg.norm(points, axis=1, keepdims=True)


def mixed(normals, seed=1):
    """Turn half of the normals round."""
    sign = np.where(np.random.default_rng(seed).random(len(normals)) < 0.5, -1.0, 1.0)
    return normals * sign[:, None]


def oriented(points, normals, spacing, front=FRONT, up=UP):
    given = mixed(normals)
    return propagate(points, given, away_votes(points, given, spacing, front=front, up=up), spacing)


def test_towards_a_sensor():
    points = ball()
    turned = towards(points, mixed(points), np.array([0.0, 0, 9]))
    facing = ((np.array([0, 0, 9]) - points) * points).sum(axis=1) >= 0
    np.testing.assert_allclose(turned, np.where(facing[:, None], points, -points))


def test_normals_of_a_closed_body_point_outwards_on_all_sides():
    points = ball()
    np.testing.assert_allclose(oriented(points, points, 0.065), points)


def test_two_bodies_apart_both_point_outwards():
    # A tangent plane propagation along a tree leaves the second one to chance.
    points = np.concatenate([ball(), ball(seed=5) * 0.5 + [2.0, 0, -1]])
    normals = np.concatenate([ball(), ball(seed=5)])
    np.testing.assert_allclose(oriented(points, normals, 0.065), normals)


def test_the_inside_of_a_hollow_that_opens_to_the_front():
    # A bowl: its inner side is seen from the front, its outer side from behind.
    inner, outer = ball(6000) * 0.8, ball(8000, seed=4)
    inner, outer = inner[inner[:, 2] < 0.0], outer[outer[:, 2] < 0.0]
    points = np.concatenate([inner, outer])
    normals = np.concatenate([-inner / 0.8, outer])
    right = (oriented(points, normals, 0.04) * normals).sum(axis=1) > 0
    assert right.mean() > 0.99


@pytest.mark.parametrize("front", [FRONT, -FRONT])
def test_a_sheet_faces_the_front(front):
    points = np.random.default_rng(0).random((2000, 3)) * [1, 1, 0]
    points[:, 2] = 0.1 * np.sin(4 * points[:, 0])
    normals = np.stack([-0.4 * np.cos(4 * points[:, 0]), np.zeros(2000), np.ones(2000)], axis=1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    np.testing.assert_allclose(oriented(points, normals, 0.022, front=front), normals * front[2])


def test_a_floor_seen_edge_on_faces_up():
    points = np.random.default_rng(0).random((2000, 3)) * [1, 0, 1]
    normals = np.tile(UP, (2000, 1))
    np.testing.assert_allclose(oriented(points, normals, 0.022), normals)


def test_many_points_follow_their_nodes(monkeypatch):
    monkeypatch.setattr("o3d_relief.scan.orientation._NODES", 500)
    points = ball(6000)
    np.testing.assert_allclose(oriented(points, points, 0.046), points)


def test_three_points_follow_their_votes():
    normals = np.tile(FRONT, (3, 1))
    turned = propagate(np.eye(3), normals, np.array([-1.0, 0.5, 0.0]), 1.0)
    assert turned[:, 2].tolist() == [-1.0, 1.0, 1.0]


def test_votes_turn_with_the_normals():
    points = ball()
    votes = away_votes(points, points, 0.065, front=FRONT, up=UP)
    assert (votes > 0).all()
    np.testing.assert_allclose(away_votes(points, -points, 0.065, front=FRONT, up=UP), -votes)


def test_edge_agreement_counts_neighbours_on_one_side():
    normals = np.array([[0, 0, 1.0], [0, 0, 1], [0, 0, -1], [0, 0, -1]])
    assert edge_agreement(np.zeros((4, 3)), normals, np.array([1, 2, 3, 2])) == 0.75
    assert edge_agreement(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0, dtype=int)) == 1.0
