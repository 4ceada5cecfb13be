import numpy as np
import pytest
import scipy.sparse as sp
import scipy.sparse.linalg as sla

from o3d_relief import cotangent_laplacian
from o3d_relief.linalg.dissection import nested_dissection
from shapes import bust, grid, hills


def _system(shape):
    vertices, faces = shape
    laplacian, _ = cotangent_laplacian(vertices, faces)
    return (laplacian + sp.diags_array(np.full(len(vertices), 0.01))).tocsr(), vertices


def test_every_unknown_has_one_place():
    matrix, positions = _system(bust(40))
    found = nested_dissection(positions, matrix)
    assert (np.sort(found.order) == np.arange(len(positions))).all()
    assert found.starts[0] == 0
    assert found.starts[-1] == len(positions)
    assert (np.diff(found.starts) > 0).all()


def test_most_unknowns_are_in_small_blocks_with_nothing_before_them():
    matrix, positions = _system(hills(41))
    found = nested_dissection(positions, matrix)
    place = np.empty(len(positions), dtype=int)
    place[found.order] = np.repeat(np.arange(len(found.starts) - 1), np.diff(found.starts))
    entries = matrix.tocoo()
    one, other = place[entries.row], place[entries.col]
    behind = np.unique(np.maximum(one, other)[one != other])
    sizes = np.delete(np.diff(found.starts), behind)
    assert sizes.max() <= 64
    assert sizes.sum() > 0.5 * len(positions)


def test_the_last_unknowns_separate_the_others():
    matrix, positions = _system(hills(41))
    order = nested_dissection(positions, matrix).order
    # The first plane leaves two halves; they meet only in a row of 41 vertices or so, which come last.
    rest = np.sort(order[:-45])
    parts, label = sp.csgraph.connected_components(matrix[rest][:, rest], directed=False)
    assert parts >= 2
    assert np.sort(np.bincount(label))[-2:].sum() > 0.95 * len(rest)
    assert np.sort(np.bincount(label))[-2] > 0.4 * len(rest)


def test_a_factor_stays_sparse():
    matrix, positions = _system(hills(81))
    order = nested_dissection(positions, matrix).order
    entries = []
    for chosen in (order, np.random.default_rng(0).permutation(len(positions))):
        ordered = matrix[chosen][:, chosen].tocsc()
        entries.append(sla.splu(ordered, permc_spec="NATURAL", diag_pivot_thresh=0.0).nnz)
    assert entries[0] < 0.2 * entries[1]
    n = len(positions)
    assert entries[0] < 10 * n * np.log2(n)


@pytest.mark.parametrize("count", [0, 1])
def test_nothing_and_one_unknown(count):
    found = nested_dissection(np.zeros((count, 3)), sp.csr_array(np.eye(count)))
    assert found.order.tolist() == list(range(count))
    assert found.starts.tolist() == list(range(count + 1))


def test_planes_cut_little_of_a_surface_and_much_of_what_is_tied_across():
    matrix, positions = _system(grid(41))
    n = len(positions)
    far = sp.coo_array((np.ones(n), (np.arange(n), np.arange(n)[::-1])), shape=(n, n))
    tied = (matrix + sp.diags_array(np.full(n, 2.0)) - far).tocsr()
    assert nested_dissection(positions, matrix).cut < 50.0
    assert nested_dissection(positions, tied).cut > 50.0
