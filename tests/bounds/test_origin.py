import numpy as np
import pytest
import trimesh
from scipy.optimize import linprog

from o3d_relief.bounds.origin import Origin, triangles_cross, triangles_overlap
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


_FLAT = np.array([[0.0, 0, 0], [4, 0, 0], [0, 4, 0]])


@pytest.mark.parametrize(
    ("corners", "crosses"),
    [
        pytest.param([[2, 2, -1], [-2, 2, 1], [2, -2, 1]], True, id="an edge through its inside"),
        pytest.param(
            [[0, 0, -1], [0, 0, 1], [4, 4, 0]], True, id="an edge through a corner, over the inside"
        ),
        pytest.param([[2, 0, -1], [2, 0, 1], [2, 2, 0]], True, id="edge through edge, twice"),
        pytest.param([[0, 0, 0], [4, 4, -1], [4, 4, 1]], True, id="corner on corner, edge beyond the other"),
        pytest.param([[1, 1, 0], [4, 4, -1], [4, 4, 1]], True, id="corner on the face, through its border"),
        pytest.param([[0, 2, -1], [0, 2, 1], [4, 2, 0]], True, id="edge through edge, and out beyond"),
        pytest.param([[2, 0, -1], [2, 0, 1], [2, -2, 0]], False, id="edge through edge, to the outside"),
        pytest.param([[1, 1, 0], [1, 1, 2], [2, 1, 2]], False, id="corner on face"),
        pytest.param([[1, 1, 0], [2, 1, 0], [2, 1, 2]], False, id="edge on face"),
        pytest.param([[0, 0, 0], [4, 0, 0], [0, 0, 4]], False, id="edge on edge, the whole"),
        pytest.param([[1, 0, 0], [2, 0, 0], [1, 2, 1]], False, id="edge on edge, a part"),
        pytest.param([[1, 0, 0], [2, -1, 1], [2, -1, -1]], False, id="corner on edge, from outside"),
        pytest.param([[0, 0, 0], [-1, -1, 1], [-1, -1, -1]], False, id="corner on corner"),
        pytest.param([[0, 0, 0], [4, 0, 0], [0, 4, 0]], False, id="the same triangle"),
        pytest.param([[1, 1, 0], [9, 1, 0], [1, 9, 0]], False, id="in one plane"),
        pytest.param([[1, 1, 1e-6], [9, 1, 1e-6], [1, 9, 1e-6]], False, id="just above"),
        pytest.param([[2, 2, 2], [2, 2, 2], [2, 2, -2]], False, id="without an area"),
    ],
)
def test_exact_contacts(corners, crosses):
    corners = np.array(corners, dtype=float)
    rng = np.random.default_rng(3)
    for i in range(12):
        turn = np.eye(3) if i == 0 else np.linalg.qr(rng.normal(size=(3, 3)))[0]
        one, other = (
            np.roll(places, i, axis=0)[:: 1 if i % 2 else -1] @ turn + i for places in (_FLAT, corners)
        )
        assert triangles_cross(one[None], other[None]).tolist() == [crosses]
        assert triangles_cross(other[None], one[None]).tolist() == [crosses]


def test_sheets_that_cross_along_lines_of_their_meshes_touch_and_sheets_whose_edges_cross_do_cross():
    """Along a line of both meshes, all triangles have an order; elsewhere edges pass through edges."""
    for shift, crosses in ((0.0, False), (3.0, True)):
        vertices, faces = grid(9, size=80)
        sheets = [vertices + np.outer(s * (vertices[:, 0] - shift), [0, 0, 1]) for s in (1.0, -1.0)]
        one, other = (
            np.repeat(sheets[0][faces], len(faces), axis=0),
            np.tile(sheets[1][faces], (len(faces), 1, 1)),
        )
        assert triangles_cross(one, other).any() == crosses


def test_triangles_of_the_picture_overlap_unless_a_side_parts_them():
    rng = np.random.default_rng(3)
    one, other = rng.uniform(-5, 5, (2, 200, 3, 2))
    found = triangles_overlap(one, other)
    for a, b, overlap in zip(one, other, found, strict=True):
        # The point that is furthest inside both, as barycentric coordinates see it.
        same_place = np.block(
            [[a.T, -b.T, np.zeros((2, 1))], [np.ones(3), np.zeros(4)], [np.zeros(3), np.ones(3), 0]]
        )
        inside = np.column_stack([-np.eye(6), np.ones(6)])
        best = linprog(
            -np.eye(7)[6],
            A_ub=inside,
            b_ub=np.zeros(6),
            A_eq=same_place,
            b_eq=[0, 0, 1, 1],
            bounds=(None, None),
        )
        assert overlap == (best.x[6] > 0)
    assert 50 < found.sum() < 150
    assert np.array_equal(found, triangles_overlap(other, one[:, ::-1]))


@pytest.mark.parametrize(
    ("corners", "overlaps"),
    [
        pytest.param([[1, 1], [1.5, 1.5], [2, 2]], True, id="on a line in the inside"),
        pytest.param([[5, 0], [5, 1], [5, 2]], False, id="on a line outside"),
        pytest.param([[1, 0], [2, 0], [3, 0]], False, id="on a line along a side"),
        pytest.param([[1, 1], [1, 1], [2, 2]], False, id="two corners in one place"),
        pytest.param([[1, 1], [1, 1], [1, 1]], False, id="all in one place"),
        pytest.param([[4 - 1e-5, 0], [9, 0], [9, 4]], False, id="by a rounding error"),
        pytest.param([[4 - 1e-3, -1], [9, -1], [4 - 1e-3, 4]], True, id="by more than that"),
    ],
)
def test_triangles_without_an_area_and_at_the_border(corners, overlaps):
    big, small = _FLAT[None, :, :2], np.array([corners], dtype=float)
    assert triangles_overlap(big, small).tolist() == [overlaps]
    assert triangles_overlap(small, big).tolist() == [overlaps]
