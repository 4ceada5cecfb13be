import numpy as np
import pytest

from o3d_relief.solid.chain import (
    bodies,
    boundary,
    edge_components,
    loops,
    one_of_each,
    separate_parts,
    volume,
    without_opposites,
)
from shapes import bust, grid, joined, sphere


def _slow_boundary(faces):
    net = {}
    for face in faces.tolist():
        for start, end in zip(face, face[1:] + face[:1], strict=True):
            if net.get((end, start), 0):
                net[end, start] -= 1
            else:
                net[start, end] = net.get((start, end), 0) + 1
    return sorted(edge for edge, count in net.items() for _ in range(count))


@pytest.mark.parametrize("seed", range(4))
def test_boundary_is_what_does_not_cancel(seed):
    rng = np.random.default_rng(seed)
    faces = rng.integers(0, 9, (30, 3))
    faces = faces[(faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])]
    edges = boundary(faces)
    assert sorted(map(tuple, edges.tolist())) == _slow_boundary(faces)
    # It is made of loops, whatever the mesh.
    walks = loops(edges)
    walked = [edge for walk in walks for edge in zip(walk.tolist(), np.roll(walk, -1).tolist(), strict=True)]
    assert sorted(walked) == sorted(map(tuple, edges.tolist()))


def test_a_closed_mesh_has_no_boundary_and_a_square_one_loop():
    assert len(boundary(bust(20)[1])) == 0
    (loop,) = loops(boundary(grid(6)[1]))
    assert len(loop) == 20


def test_parts_over_edges_and_bodies_over_vertices():
    first, second = sphere(8)[1], sphere(8)[1]
    _, faces = joined(sphere(8), sphere(8))
    assert len(first) == len(second)
    assert np.bincount(edge_components(faces)).tolist() == [len(first)] * 2
    touching = np.array([[0, 1, 2], [2, 3, 4]])
    assert edge_components(touching).tolist() == [0, 1]
    assert bodies(touching).tolist() == [0, 0]


def test_duplicates_and_opposites():
    faces = np.array([[0, 1, 2], [1, 2, 0], [3, 4, 5], [5, 4, 3], [6, 7, 8], [8, 7, 6], [7, 6, 8]])
    assert one_of_each(faces).tolist() == [0, 2, 4]
    assert without_opposites(faces).tolist() == [0, 5]


def test_volume_of_a_box_anywhere():
    from trimesh.creation import box

    mesh = box(bounds=[[100, 200, 300], [102, 203, 304]])
    assert volume(np.array(mesh.vertices), np.array(mesh.faces)) == pytest.approx(24.0)
    assert volume(np.array(mesh.vertices), np.array(mesh.faces)[:, ::-1]) == pytest.approx(-24.0)


def test_boxes_that_share_an_edge_are_two_parts():
    from trimesh.creation import box
    from trimesh.util import concatenate

    mesh = concatenate([box(bounds=[[0, 0, 0], [1, 1, 1]]), box(bounds=[[1, 1, 0], [2, 2, 1]])])
    mesh.merge_vertices()
    faces = np.array(mesh.faces)
    assert edge_components(faces).max() == 0
    assert separate_parts(faces).tolist() == [0] * 12 + [1] * 12
    assert separate_parts(faces[1:]).tolist() == [0] * 11 + [1] * 12  # the second is whole by itself
    assert separate_parts(faces[1:-1]).max() == 0  # neither is
