import numpy as np
import pytest

from refined import refined
from shapes import bust, to_mesh


def _volume(mesh):
    a, b, c = np.asarray(mesh.vertices)[np.asarray(mesh.triangles)].transpose(1, 0, 2)
    return (np.cross(a, b) * c).sum() / 6.0


@pytest.fixture(scope="module")
def mesh():
    return to_mesh(bust(40))


@pytest.mark.parametrize("vertices", [500, 3000, 4000, 20_000])
def test_meshes_of_any_size(mesh, vertices):
    found = refined(mesh, vertices)
    assert len(found.vertices) == pytest.approx(vertices, rel=0.02)
    assert found.is_edge_manifold(allow_boundary_edges=False)
    assert _volume(found) == pytest.approx(_volume(mesh), rel=0.03)


def test_the_noise_is_little_and_the_same_each_time(mesh):
    one, other = refined(mesh, 20_000), refined(mesh, 20_000, seed=1)
    assert np.asarray(one.vertices).tobytes() == np.asarray(refined(mesh, 20_000).vertices).tobytes()
    off = np.linalg.norm(np.asarray(one.vertices) - np.asarray(other.vertices), axis=1)
    corners = np.asarray(one.vertices)[np.asarray(one.triangles)]
    edge = np.linalg.norm(corners[:, 0] - corners[:, 1], axis=1).mean()
    assert 0.0 < off.mean() < 0.1 * edge


def test_the_mesh_is_not_changed(mesh):
    before = np.array(mesh.vertices)
    refined(mesh, 20_000)
    assert (np.asarray(mesh.vertices) == before).all()
