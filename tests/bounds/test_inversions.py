import numpy as np
import pytest

from o3d_relief.bounds.grid import grid_pairs
from o3d_relief.bounds.inversions import inversions
from o3d_relief.bounds.lines import Lines
from o3d_relief.bounds.origin import Origin
from o3d_relief.bounds.pairs import Pairs, as_points, vertex_pairs
from shapes import grid, joined, moved


def _plates():
    scene, faces = joined(grid(11), moved(grid(5, size=40), (0, 0, 10)))
    return scene, faces, Origin(faces, faces, scene)


def test_swapped_plates_are_inverted_and_others_are_not():
    scene, faces, origin = _plates()
    relief = scene.copy()
    relief[121:, 2] = -3.0
    for pairs in (vertex_pairs(Lines(relief, faces)), grid_pairs(Lines(relief, faces), side=64)):
        found = inversions(relief, pairs, scene[:, 2], origin)
        assert found.inverted == found.tested > 0
        assert found.crossed == 0
        assert found.worst == pytest.approx(10.0, abs=1e-3)
        assert len(found.places) == 10
        assert all(abs(place.x) <= 20 and abs(place.y) <= 20 for place in found.places)
        assert {place.kind for place in found.places} == {"inversion"}
        assert inversions(relief, pairs, relief[:, 2], origin).inverted == 0


def test_what_crossed_in_the_scene_does_not_count():
    wall, tilted = grid(2), moved(grid(2, size=40), (0, 0, 0))
    tilted = tilted[0] + [[0, 0, x] for x, _, _ in tilted[0]], tilted[1]  # half of it behind the wall
    scene, faces = joined(wall, tilted)
    relief = scene * [1, 1, -1]
    pairs = grid_pairs(Lines(relief, faces), side=64)
    found = inversions(relief, pairs, scene[:, 2], Origin(faces, faces, scene))
    assert found.inverted == 0
    assert found.crossed == len(pairs) > 100
    assert {place.kind for place in found.places} == {"old inversion"}


def test_gaps_that_became_too_small_are_counted():
    scene, faces, origin = _plates()
    relief = scene * [1, 1, 0.1]
    pairs = grid_pairs(Lines(relief, faces), side=64)
    assert inversions(relief, pairs, scene[:, 2], origin, min_gap=2.0).gaps_missed == len(pairs)
    assert inversions(relief, pairs, scene[:, 2], origin, min_gap=0.5).gaps_missed == 0
    assert inversions(relief, pairs, relief[:, 2], origin, min_gap=2.0).gaps_tested == 0


@pytest.mark.parametrize(("overlap", "inverted"), [(0.0, 0), (1e-6, 0), (0.01, 1)])
def test_surfaces_that_only_touch_in_the_picture_are_in_no_order(overlap, inverted):
    # The second begins where the first ends; rays at its border meet the first by chance.
    scene, faces = joined(grid(3, size=20), moved(grid(3, size=20), (20 - overlap, 5, 10)))
    corner, weights = as_points(np.array([9]))
    side, share = np.array([[3, 6, 7]]), np.array([[0.0, 0.5, 0.5]])
    assert scene[9, :2] == pytest.approx(share[0] @ scene[side[0], :2], abs=0.011)
    relief = scene * [1, 1, -1]
    pairs = Pairs(upper=side, upper_weights=share, lower=corner, lower_weights=weights, gap=np.array([10.0]))
    found = inversions(relief, pairs, scene[:, 2], Origin(faces, faces, scene))
    assert found.inverted == inverted
    assert found.tested == 1
    # Nor is a gap between them missed.
    flat = scene * [1, 1, 0.1]
    pairs = Pairs(upper=corner, upper_weights=weights, lower=side, lower_weights=share, gap=np.array([1.0]))
    close = inversions(flat, pairs, scene[:, 2], Origin(faces, faces, scene), min_gap=2.0)
    assert (close.gaps_tested, close.gaps_missed) == (1, inverted)
    assert len(close.places) == inverted
