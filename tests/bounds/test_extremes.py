import numpy as np
import pytest
from scipy.spatial import ConvexHull

from o3d_relief.bounds.extremes import extreme_pairs
from o3d_relief.bounds.grid import grid_pairs
from o3d_relief.bounds.lines import Lines
from o3d_relief.bounds.pairs import Pairs
from shapes import bust, grid, joined, moved


def places(pairs, vertices):
    return np.einsum("pck,pc->pk", vertices[pairs.upper, :2], pairs.upper_weights)


def test_two_large_triangles_keep_what_spans_the_others():
    vertices, faces = joined(grid(2, size=10.0), moved(grid(2, size=10.0), (0.0, 0.0, 5.0)))
    pairs = grid_pairs(Lines(vertices, faces), side=64)
    kept = extreme_pairs(pairs, vertices[:, :2], side=64)
    assert 0 < len(kept) < 0.1 * len(pairs)
    area = ConvexHull(places(pairs, vertices)).volume
    assert ConvexHull(places(kept, vertices)).volume == pytest.approx(area, rel=1e-6)


def test_a_bound_on_what_is_kept_holds_on_all():
    vertices, faces = bust(8)
    pairs = grid_pairs(Lines(vertices, faces), side=128)
    kept = extreme_pairs(pairs, vertices[:, :2], side=128)
    assert len(kept) < 0.5 * len(pairs)
    rng = np.random.default_rng(3)
    for _ in range(5):
        z = vertices[:, 2] + rng.normal(scale=5.0, size=len(vertices))
        ratio, of_kept = (np.subtract(*some.heights(z)) / some.gap for some in (pairs, kept))
        assert of_kept.min() <= ratio.min() + 1e-6
        assert of_kept.max() >= ratio.max() - 1e-6


def test_no_pairs_stay_none():
    assert len(extreme_pairs(Pairs.join([]), np.zeros((3, 2)))) == 0
