import numpy as np
import trimesh

from o3d_relief.bounds.origin import Origin, triangles_cross
from shapes import grid, joined, moved


def test_random_triangles_cross_like_their_edges_do():
    rng = np.random.default_rng(1)
    one, other = rng.normal(size=(2, 300, 3, 3))
    expected = [_edges_pierce(a, b) or _edges_pierce(b, a) for a, b in zip(one, other, strict=True)]
    assert 30 < sum(expected) < 270
    assert triangles_cross(one, other).tolist() == expected


def _edges_pierce(edges, face):
    """Intersect the edges of a triangle with the plane of another, and look at barycentric coordinates."""
    normal = np.cross(face[1] - face[0], face[2] - face[0])
    for i in range(3):
        p, q = edges[i], edges[(i + 1) % 3]
        t = normal @ (face[0] - p) / (normal @ (q - p))
        weights = trimesh.triangles.points_to_barycentric(face[None], [p + t * (q - p)])
        if 0 < t < 1 and (weights > 0).all():
            return True
    return False


def test_neighbours_and_coplanar_triangles_do_not_cross():
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 1], [0.2, 0.2, 0.0]])
    flat, neighbour, coplanar = corners[[0, 1, 2]], corners[[1, 2, 3]], corners[[0, 4, 1]]
    assert not triangles_cross(np.stack([flat, flat]), np.stack([neighbour, coplanar])).any()


def test_places_stand_for_all_triangles_around_them():
    wall, blade = grid(3), moved(grid(2, size=40), (10, 10, 0))
    blade = blade[0][:, [2, 1, 0]] + [10, 0, 0], blade[1]  # upright, through the wall
    scene, faces = joined(wall, blade)
    origin = Origin(faces, faces, scene)
    tip = faces[-1][:1]
    middle = 4  # the vertex in the middle of the wall, where all its crossed triangles meet
    one = np.array([[middle] * 3, [middle] * 3, [0, 0, 0]])
    other = np.array([np.repeat(tip, 3), [0, 0, 0], np.repeat(tip, 3)])
    assert origin.crossed(one, other).tolist() == [True, False, bool(_touches(faces, scene, 0, tip[0]))]
    assert origin.crossed(np.zeros((0, 3), dtype=int), np.zeros((0, 3), dtype=int)).tolist() == []


def _touches(faces, scene, a, b):
    around_a, around_b = faces[(faces == a).any(axis=1)], faces[(faces == b).any(axis=1)]
    return any(triangles_cross(scene[[p]], scene[[q]])[0] for p in around_a for q in around_b)
