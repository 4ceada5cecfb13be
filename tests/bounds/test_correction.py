import numpy as np

from o3d_relief import cotangent_laplacian
from o3d_relief.bounds.correction import Correction
from o3d_relief.bounds.lines import Lines
from o3d_relief.bounds.pairs import Pairs, vertex_pairs
from o3d_relief.linalg.laplacian import vertex_areas
from shapes import grid, joined, moved

GAP = 0.5


def _two_places():
    """Two small plates over large ones, far from each other; both have sunk below them."""
    here = joined(grid(9, size=20), moved(grid(5, size=4), (0, 0, 3)))
    vertices, faces = joined(moved(here, (-60, 0, 0)), moved(here, (60, 0, 0)))
    z = np.where(vertices[:, 2] > 0, -1.0, 1.0)
    return vertices, faces, z, vertex_pairs(Lines(vertices, faces))


def _solved(vertices, faces, z, *calls):
    laplacian, _ = cotangent_laplacian(vertices, faces)
    correction = Correction(vertices, laplacian, vertex_areas(vertices, faces), z)
    floor = np.zeros(len(z), dtype=bool)
    for pairs, new in calls:
        at = np.zeros(len(z), dtype=bool)
        at[new.upper] = True
        at[new.lower] = True
        found = correction.solve(pairs, np.full(len(pairs), GAP), floor, at)
    return found


def _gaps(pairs, z):
    return np.subtract(*pairs.heights(z))


def test_places_that_do_not_hang_together_do_not_know_of_each_other():
    vertices, faces, z, pairs = _two_places()
    left = pairs.select(vertices[pairs.upper[:, 0], 0] < 0)
    right = pairs.select(vertices[pairs.upper[:, 0], 0] > 0)
    both = _solved(vertices, faces, z, (pairs, pairs))
    one = _solved(vertices, faces, z, (left, left))
    assert 0 < len(left) < len(pairs)
    assert np.array_equal(one[vertices[:, 0] > 0], z[vertices[:, 0] > 0])
    assert _gaps(pairs, both).min() > GAP - 1e-5
    after = _solved(vertices, faces, z, (left, left), (pairs, right))
    assert np.array_equal(after[vertices[:, 0] < 0], one[vertices[:, 0] < 0])
    assert _gaps(pairs, after).min() > GAP - 1e-5


def test_the_same_pairs_twice_are_the_same_programme():
    vertices, faces, z, pairs = _two_places()
    once = _solved(vertices, faces, z, (pairs, pairs))
    twice = _solved(vertices, faces, z, (Pairs.join([pairs, pairs]), pairs))
    assert np.array_equal(once, twice)


def test_what_leaves_no_room_moves_although_it_is_far():
    """A plate on the floor, one above it, and over both a triangle whose corners are far away."""
    triangle = np.array([[-60, -50, 2], [60, -50, 2], [0, 70, 2.0]]), np.array([[0, 1, 2]])
    low, plate = grid(5, size=4), moved(grid(5, size=4), (0, 0, 1))
    vertices, faces = joined(low, plate, triangle)
    z = vertices[:, 2].copy()
    laplacian, _ = cotangent_laplacian(vertices, faces)
    correction = Correction(vertices, laplacian, vertex_areas(vertices, faces), z)
    floor = vertices[:, 2] == 0
    pairs = vertex_pairs(Lines(vertices, faces))
    on_plate = vertices[pairs.upper[:, 0], 2] == 1
    above, below = pairs.select(~on_plate), pairs.select(on_plate)
    new = np.zeros(len(z), dtype=bool)
    new[above.lower] = True
    new[above.upper] = True
    first = correction.solve(above, np.full(len(above), 1.2), floor, new)
    new[:] = False
    new[below.upper] = True
    everything = Pairs.join([above, below])
    wanted = np.concatenate([np.full(len(above), 1.2), np.full(len(below), 3.0)])
    found = correction.solve(everything, wanted, floor, new)
    assert _gaps(above, first).min() > 1.2 - 1e-5
    assert (_gaps(everything, found) > wanted - 1e-4).all()
    assert (found[floor] > -1e-4).all()
    assert found[-3:].min() > first[-3:].max()
