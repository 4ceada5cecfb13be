import numpy as np

from o3d_relief import cotangent_laplacian
from o3d_relief.bounds.gaps import out_of_order
from o3d_relief.bounds.grid import grid_pairs
from o3d_relief.bounds.hinges import hinged_pairs
from o3d_relief.bounds.lines import Lines
from o3d_relief.bounds.order import keep_order
from o3d_relief.bounds.silhouettes import silhouette_pairs
from o3d_relief.linalg.laplacian import vertex_areas


def _fold():
    """A sheet that turns back at a corner: one triangle lies before the other one."""
    plane = [[0.0, 0.0], [-1.45, 1.17], [4.7, 0.4], [2.34, 0.39], [-4.38, 0.11]]
    vertices = np.column_stack([plane, [10.0, -3.3, -1.4, 22.1, 21.0]])
    return vertices, np.array([[0, 2, 1], [0, 3, 4]])


def test_a_fold_that_turned_inside_out_at_the_plane_is_put_right_in_front_of_it():
    vertices, faces = _fold()
    # Only the corner is in front: where the edges cross, both triangles are behind S already.
    z = np.array([1.4, -7.8, -1.6, -0.6, -5.4])
    known, lines = silhouette_pairs(vertices, faces), grid_pairs(Lines(vertices, faces), side=400)
    assert not out_of_order(known, z).any()
    assert out_of_order(lines, z).any()
    laplacian, _ = cotangent_laplacian(vertices, faces)
    found = keep_order(vertices, faces, laplacian, vertex_areas(vertices, faces), z, known)
    assert found.left == 0
    assert not out_of_order(lines, found.z).any()


def test_what_hangs_together_behind_the_plane_may_turn():
    vertices, faces = _fold()
    known = silhouette_pairs(vertices, faces)
    z = np.array([1.4, -7.8, -1.6, -0.6, -5.4])
    assert len(hinged_pairs(vertices, faces, known, z)) > 0
    assert len(hinged_pairs(vertices, faces, known, z - 2.0)) == 0
    apart = np.array([[0, 2, 1], [5, 3, 4]])  # the same place, but two vertices
    assert len(hinged_pairs(np.vstack([vertices, vertices[:1]]), apart, known, np.append(z, z[0]))) == 0
