import numpy as np
import pytest

from o3d_relief.bounds.lines import Lines
from o3d_relief.bounds.pairs import vertex_pairs
from o3d_relief.bounds.silhouettes import silhouette_pairs, silhouettes
from shapes import bust, grid, joined, moved, sphere


def _bar(angle, z):
    """A bar of two triangles, from -40 to 40 along x before it is turned."""
    corners = np.array([[-40.0, -2, 0], [40, -2, 0], [40, 2, 0], [-40, 2, 0]])
    c, s = np.cos(angle), np.sin(angle)
    return moved((corners @ [[c, s, 0], [-s, c, 0], [0, 0, 1]], np.array([[0, 1, 2], [0, 2, 3]])), (0, 0, z))


def test_a_plate_ends_at_its_border():
    vertices, faces = grid(9)
    edges = silhouettes(vertices, faces)
    assert len(edges) == 4 * 8
    assert (np.abs(vertices[edges, :2]).max(axis=2) == 50.0).all()


def test_a_ball_turns_back_at_its_equator():
    vertices, faces = sphere(24)
    turned = vertices[:, [1, 2, 0]]  # no edge of it in the plane of the equator
    edges = silhouettes(turned, faces)
    assert np.abs(np.linalg.norm(turned[edges][:, :, :2], axis=2) - 50).max() < 1.0
    flipped = faces.copy()
    flipped[::2] = flipped[::2, ::-1]  # whichever way its faces turn
    assert np.array_equal(silhouettes(turned, flipped), edges)


@pytest.mark.parametrize("angle", [0.5, 1.5])
def test_crossed_bars_have_a_pair_at_each_corner(angle):
    vertices, faces = joined(_bar(0.0, 0.0), _bar(angle, 3.0))
    pairs = silhouette_pairs(vertices, faces)
    assert (
        len(vertex_pairs(Lines(vertices, faces))) == 0
    )  # no vertex above the other bar: nothing else would tell
    assert pairs.gap == pytest.approx([3.0] * 4)
    upper, lower = pairs.heights(vertices[:, 2])
    assert upper - lower == pytest.approx(pairs.gap)
    places = [
        np.einsum("pcx,pc->px", vertices[corners], weights)[:, :2]
        for corners, weights in ((pairs.upper, pairs.upper_weights), (pairs.lower, pairs.lower_weights))
    ]
    assert places[0] == pytest.approx(places[1])
    assert np.abs(places[0][:, 1]) == pytest.approx(2.0)  # on the border of the first bar


def test_bars_that_touch_or_end_in_each_other_have_none():
    assert len(silhouette_pairs(*joined(_bar(0.0, 0.0), _bar(1.5, 1e-4)))) == 0
    assert len(silhouette_pairs(*joined(_bar(0.0, 0.0), moved(_bar(0.0, 3.0), (0, 4.0, 0))))) == 0


def test_as_many_as_by_comparing_every_two_edges():
    vertices, faces = bust(20)
    edges = silhouettes(vertices, faces)
    begin, end = vertices[edges[:, 0], :2], vertices[edges[:, 1], :2]

    def side(p, a, b):
        return (b - a)[..., 0] * (p - a)[..., 1] - (b - a)[..., 1] * (p - a)[..., 0]

    a, b, c, d = begin[:, None], end[:, None], begin[None], end[None]
    cross = (side(a, c, d) * side(b, c, d) < -1e-3) & (side(c, a, b) * side(d, a, b) < -1e-3)
    every = {tuple(edge) for edge in edges}
    pairs = silhouette_pairs(vertices, faces)
    ends = (np.sort(corners[:, :2], axis=1) for corners in (pairs.upper, pairs.lower))
    both = [tuple(one) in every and tuple(other) in every for one, other in zip(*ends, strict=True)]
    assert sum(both) == cross.sum() // 2 > 10
