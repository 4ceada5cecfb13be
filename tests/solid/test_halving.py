import itertools

import numpy as np
import pytest

from o3d_relief.solid.halving import halved


@pytest.mark.parametrize("chosen", list(itertools.product([False, True], repeat=3)))
def test_every_case_covers_the_face_once(chosen):
    places = np.array([[0, 0], [2, 0], [0, 2], [1, 0], [1, 1], [0, 1]], dtype=float)
    result = halved(np.array([[0, 1, 2]]), np.array([chosen]), 3)
    a, b, c = places[result.corners].transpose(1, 0, 2)
    area = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    assert (area > 0).all()
    assert area.sum() == 4.0
    assert set(result.corners.ravel()) == {0, 1, 2} | {3 + k for k, edge in enumerate(chosen) if edge}
    assert len(result.pairs) == sum(chosen)
    assert (result.source == 0).all()


def test_a_shared_edge_gets_one_middle():
    chosen = np.array([[False, True, False], [True, False, False]])
    result = halved(np.array([[0, 1, 2], [2, 1, 3]]), chosen, 4)
    assert result.pairs.tolist() == [[1, 2]]
    assert (result.faces == 4).any(axis=1).sum() == 4
