import numpy as np
import pytest

from o3d_relief.bounds.near_points import NearPoints
from o3d_relief.bounds.stiffness import Stiffness
from o3d_relief.linalg.laplacian import cotangent_laplacian
from shapes import grid


def test_only_faces_near_a_point_become_stiffer():
    vertices, faces = grid(101)  # one unit between vertices
    plain, _ = cotangent_laplacian(vertices, faces)
    centre = int(np.linalg.norm(vertices, axis=1).argmin())
    stiff = NearPoints(vertices, faces, np.ones(len(vertices), dtype=bool), np.array([centre])).stiffness
    form = stiff.added_to(plain, 3.0)
    change = np.asarray(abs(form - plain).sum(axis=1)).ravel()
    distance = np.linalg.norm(vertices, axis=1)
    assert change[centre] > 0.0
    assert change[distance > 3.5].max() == 0.0
    assert stiff.within[centre]
    assert distance[stiff.within].max() < 3.5
    assert form.sum(axis=1) == pytest.approx(0.0, abs=1e-9)
    assert abs(stiff.added_to(plain, 0.0) - plain).max() == 0.0


def test_weight_of_a_face():
    vertices = np.array([[0.0, 0, 0], [3, 0, 0], [0, 3, 0], [3, 3, 0]])
    faces = np.array([[0, 1, 2], [1, 3, 2]])
    plain, _ = cotangent_laplacian(vertices, faces[:1])
    stiff = Stiffness(vertices, faces, np.array([2.0**0.5, np.inf]))
    added = stiff.added_to(plain * 0.0, 8.0)
    assert added.toarray() == pytest.approx(8.0 * 0.25 * plain.toarray())
