import numpy as np

from o3d_relief.bounds.crossings import crossings, edges_of
from o3d_relief.bounds.new_crossings import around, new_crossings
from shapes import grid, joined, moved

NEEDLE = np.array([[-3.0, 21.0, -1.0], [5.0, 22.0, 1.0], [5.0, 29.0, 1.0]]), np.array([[0, 1, 2]])
"""A triangle whose upper edge leans across the middle of the plane z = 0."""


def test_new_crossings_bring_along_what_is_about_to_follow():
    before, faces = joined(grid(9), moved(NEEDLE, (1.0, -20.0, 3.0)))
    z = before[:, 2] - np.where(np.arange(len(before)) < 81, 0.0, 3.0)
    pairs, count = new_crossings(before, faces, edges_of(faces), z + 5.0)  # in front of S
    found = crossings(np.column_stack([before[:, :2], z]), faces, edges_of(faces))
    assert count == found.pierced(z).sum() > 0
    assert len(pairs) > 2 * count
    assert (pairs.gap > 1.5).all()  # upper and lower as they were
    assert new_crossings(before, faces, edges_of(faces), before[:, 2] + 5.0)[1] == 0
    assert new_crossings(before, faces, edges_of(faces), z - 5.0)[1] == 0  # cut off


def test_around_a_crossing_are_the_edges_and_triangles_next_to_it():
    vertices, faces = joined(grid(9), moved(NEEDLE, (1.0, -20.0, 0.0)))
    found = crossings(vertices, faces, edges_of(faces))
    found = found.select(found.pierced(vertices[:, 2]))
    assert len(found) > 0
    near = around(found, vertices, faces)
    assert len(near) > len(found)
    assert (near.edge[:, :, None] != near.face[:, None, :]).all()
    # Each has the needle on one side, and a triangle or edge of the plane on the other.
    assert ((near.edge >= 81).all(axis=1) ^ (near.face >= 81).all(axis=1)).all()
    pierced = {tuple(edge) for edge in found.edge}
    assert pierced <= {tuple(edge) for edge in near.edge}
    uncrossed = around(found, vertices, faces, uncrossed=True)
    assert len(uncrossed) < len(near)
