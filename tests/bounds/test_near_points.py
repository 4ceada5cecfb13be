import numpy as np
import pytest

from o3d_relief.bounds.near_points import NearPoints
from shapes import grid, hills


def test_a_spike_at_a_point_bends_what_is_made_stiffer():
    vertices, faces = grid(101)  # one unit between vertices
    point = int(np.linalg.norm(vertices, axis=1).argmin())
    around = NearPoints(vertices, faces, np.ones(len(vertices), dtype=bool), np.array([point]))
    z = np.zeros(len(vertices))
    z[point] = 3.0
    near, elsewhere = around.bends.most(z)
    assert near > 45.0
    assert elsewhere == pytest.approx(0.0)
    assert around.stiffness.within[point]
    assert around.bends is around.bends


def test_the_surface_is_stiffer_within_reach_of_every_point_and_nowhere_else():
    vertices, faces = hills(61)
    index = np.random.default_rng(2).choice(len(vertices), 9, replace=False)
    around = NearPoints(vertices, faces, np.ones(len(vertices), dtype=bool), index)
    middle = vertices[faces].mean(axis=1)
    distance = np.linalg.norm(middle[:, None] - vertices[index], axis=2).min(axis=1)
    within = np.zeros(len(vertices), dtype=bool)
    within[faces[distance < 2.0]] = True
    assert 0 < within.sum() < len(within) / 2
    assert (around.stiffness.within == within).all()
