import numpy as np
import pytest

from o3d_relief.bounds.near_points import NearPoints
from shapes import grid


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
