import numpy as np
import pytest

from o3d_relief.bounds.bends import normal_changes
from shapes import grid


def test_turned_normals():
    vertices, faces = grid(21)
    after = vertices.copy()
    after[:, 2] = vertices[:, 0]  # every face turns by 45 degrees
    everything = np.ones(len(vertices), dtype=bool)
    near, elsewhere = normal_changes(vertices, after, faces, everything, np.array([220]))
    assert near == pytest.approx(45.0) or len(near) == 0
    assert elsewhere == pytest.approx(45.0)
    assert len(near) + len(elsewhere) == len(faces)
