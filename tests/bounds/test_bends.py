import numpy as np
import pytest

from o3d_relief.bounds.bends import Bends
from shapes import grid


def test_turned_normals():
    vertices, faces = grid(21)
    everything = np.ones(len(vertices), dtype=bool)
    # Every face turns by 45 degrees.
    near, elsewhere = Bends(vertices, faces, everything, 3.0 * (np.arange(len(faces)) % 2)).angles(
        vertices[:, 0]
    )
    assert near == pytest.approx(45.0)
    assert elsewhere == pytest.approx(45.0)
    assert len(near) + len(elsewhere) == len(faces) == 2 * len(near)
