import numpy as np
import pytest

from o3d_relief.bounds.borders import Borders
from shapes import hills, joined, moved, sphere


def _grazed(vertices, faces, triangle, weights):
    """Tell slowly which points are within 1e-3 of an edge of one face only, seen from the front."""
    edges = np.sort(faces[:, [[1, 2], [2, 0], [0, 1]]].reshape(-1, 2), axis=1)
    single, count = np.unique(edges, axis=0, return_counts=True)
    single = {tuple(edge) for edge in single[count == 1].tolist()}
    ends = {end for edge in single for end in edge}
    found = []
    for face, weight in zip(faces[triangle], weights, strict=True):
        place = vertices[face, :2]
        sides = [place[i - 1] - place[i - 2] for i in range(3)]
        area = abs(sides[0][0] * sides[1][1] - sides[0][1] * sides[1][0])
        near = [weight[i] * area / np.linalg.norm(sides[i]) < 1e-3 for i in range(3)]
        at_edge = [near[i] and tuple(sorted((face[i - 1], face[i - 2]))) in single for i in range(3)]
        at_corner = [near[i - 2] and near[i - 1] and face[i] in ends for i in range(3)]
        found.append(any(at_edge) or any(at_corner))
    return np.array(found)


def _scenes():
    closed, rough = sphere(8), hills(9)
    ragged = rough[1][np.random.default_rng(1).random(len(rough[1])) > 0.2]
    mixed = np.where(
        (np.random.default_rng(2).random(len(closed[1])) > 0.5)[:, None], closed[1], closed[1][:, ::-1]
    )
    three = joined(rough, (rough[0][:3] + np.array([0, 0, 5.0]), np.array([[0, 1, 2]])))
    return {
        "closed": closed,
        "open": rough,
        "holes": (rough[0], ragged),
        "turned": (closed[0], mixed),
        "two": joined(rough, moved(closed, (1.0, 2.0, 60.0))),
        "narrow": three,
        "twice": (rough[0], np.concatenate([rough[1], rough[1][:5]])),
    }


@pytest.mark.parametrize("name", list(_scenes()))
def test_agrees_with_the_slow_way(name):
    vertices, faces = _scenes()[name]
    random = np.random.default_rng(0)
    triangle = random.integers(0, len(faces), 600)
    weights = np.concatenate([random.dirichlet([0.05] * 3, 300), np.eye(3)[random.integers(0, 3, 300)]])
    found = Borders(vertices, faces).grazed(triangle, weights)
    assert np.array_equal(found, _grazed(vertices, faces, triangle, weights))
    assert found.any() == (name not in ("closed", "turned"))
