import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from o3d_relief.stages.clustering import cluster_vertices


def _points(n, seed=0):
    return np.random.default_rng(seed).uniform(-50, 50, size=(n, 2))


@pytest.mark.parametrize("n", [3000, 90_000])
def test_every_vertex_belongs_to_its_nearest_centre(n):
    xy = _points(n)
    labels, centers = cluster_vertices(xy, 20)
    assert centers.shape == (20, 2)
    distance = np.linalg.norm(xy[:, None] - centers, axis=2)
    assert distance[np.arange(n), labels] == pytest.approx(distance.min(axis=1), abs=1e-12)


def test_cells_are_nearly_as_good_as_all_vertices():
    xy = _points(90_000)
    _, coarse = cluster_vertices(xy, 16, seed=1)
    _, exact = cluster_vertices(xy[::2], 16, seed=1)

    def cost(centers):
        return (np.linalg.norm(xy[:, None] - centers, axis=2).min(axis=1) ** 2).mean()

    assert cost(coarse) < 1.03 * cost(exact)


def test_same_seed_same_bytes_on_one_and_on_all_threads():
    xy = _points(20_000)
    labels, centers = cluster_vertices(xy, 30, seed=5)
    with threadpool_limits(limits=1):
        labels_again, centers_again = cluster_vertices(xy, 30, seed=5)
    assert labels.tobytes() == labels_again.tobytes()
    assert centers.tobytes() == centers_again.tobytes()
    assert cluster_vertices(xy, 30, seed=6)[1].tobytes() != centers.tobytes()


def test_fewer_positions_than_clusters():
    xy = np.repeat(np.array([[0.0, 0], [5, 5], [9, 1]]), 4, axis=0)
    labels, centers = cluster_vertices(xy, 8)
    assert len(centers) == 3
    assert len(set(labels[::4])) == 3


def test_vertices_themselves_are_used_where_they_fill_few_cells():
    xy = _points(70_000) * [1.0, 1e-4]
    labels, centers = cluster_vertices(xy, 20)
    assert len(centers) == 20
    assert np.bincount(labels).min() > 2000
