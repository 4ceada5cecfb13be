import numpy as np
import pytest

import o3d_relief as rel
from o3d_relief.bounds.silhouettes import silhouette_pairs
from shapes import grid, joined, moved, to_mesh


def _leaning(side, lean, *, size=50):
    vertices, faces = grid(side, size=size)
    return vertices + np.outer(40.0 + lean * vertices[:, 0], [0, 0, 1]), faces


def _on_lines(vertices, pairs):
    """Tell that both points of each pair lie on one vertical line, to the rounding that is allowed."""
    upper, lower = (
        np.einsum("pcx,pc->px", vertices[corners, :2], weights)
        for corners, weights in ((pairs.upper, pairs.upper_weights), (pairs.lower, pairs.lower_weights))
    )
    return np.abs(upper - lower).max(initial=0.0) < 2e-3


def test_plates_of_one_outline_have_pairs_all_around():
    vertices, faces = joined(grid(5, size=50), moved(grid(4, size=50), (0, 0, 3)))
    pairs = silhouette_pairs(vertices, faces)
    assert pairs.gap == pytest.approx(3.0)
    assert _on_lines(vertices, pairs)
    at_border = np.abs(vertices[:, :2]).max(axis=1) > 24.9
    above, below = (set(ends.ravel()) for ends in (pairs.upper, pairs.lower))
    assert above == set(np.flatnonzero(at_border & (vertices[:, 2] > 0)))
    assert below == set(np.flatnonzero(at_border & (vertices[:, 2] == 0)))
    upper, lower = pairs.heights(vertices[:, 2])
    assert upper - lower == pytest.approx(pairs.gap)


def test_of_many_on_top_of_each_other_the_next_ones_are_paired():
    vertices, faces = joined(*[moved(grid(2, size=50), (0, 0, z)) for z in (0, 7, 3, 12)])
    pairs = silhouette_pairs(vertices, faces)
    assert set(pairs.gap) == {3.0, 4.0, 5.0}
    assert len(np.unique(pairs.gap)) == 3


def test_a_plate_that_ends_on_the_border_of_a_larger_one_has_pairs_on_their_common_side_only():
    plate, half = grid(2, size=40), moved(grid(2, size=20), (0, 0, 5))
    inside = silhouette_pairs(*joined(plate, moved(half, (10, 0, 0))))
    outside = silhouette_pairs(*joined(plate, moved(half, (30, 0, 0))))
    assert len(inside) == 2
    assert inside.gap == pytest.approx(5.0)
    assert len(outside) == 0


@pytest.mark.parametrize("side", [8, 9])
@pytest.mark.parametrize("lean", [0.6, 1.0])
def test_plates_of_one_outline_that_lean_through_each_other_keep_their_order(side, lean):
    """With 9 lines, edges lie exactly above edges; with 8, borders do."""
    plates = [moved(grid(9, size=50), (0, 0, z)) for z in (10, 20, 30)]
    scene = joined(grid(31), *plates, _leaning(side, lean))
    relief = rel.make_relief(to_mesh(scene), rel.ReliefParams(k=32))
    assert relief.certificate.failures == []
    assert relief.certificate.old_inversions > 0  # beside the place where they cross, which may move
