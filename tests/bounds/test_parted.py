import numpy as np

from o3d_relief import cotangent_laplacian
from o3d_relief.bounds.gaps import out_of_order
from o3d_relief.bounds.grid import grid_pairs
from o3d_relief.bounds.lines import Lines
from o3d_relief.bounds.order import keep_order
from o3d_relief.bounds.pairs import Pairs, close_pairs, vertex_pairs
from o3d_relief.bounds.parted import Parted
from o3d_relief.bounds.raster import Raster
from o3d_relief.bounds.silhouettes import silhouette_pairs
from o3d_relief.linalg.laplacian import vertex_areas
from shapes import grid, joined, moved


def _roof_through_plate():
    """A long roof with a narrow flat top, which looks out of a plate between the rows of its vertices."""
    x, y, z = [-40.0, 40.0], [-3.0, 0.95, 1.05, 5.0], [-8.0, 0.05, 0.05, -8.0]
    roof = np.array([[a, b + 0.0, c] for b, c in zip(y, z, strict=True) for a in x])
    strips = np.array(
        [[2 * i, 2 * i + 1, 2 * i + 3] for i in range(3)] + [[2 * i, 2 * i + 3, 2 * i + 2] for i in range(3)]
    )
    return moved(joined(grid(11, size=20.0), (roof, strips)), (0.0, 0.0, 20.0))


def _known(vertices, faces):
    lines = Lines(vertices, faces)
    return Pairs.join([vertex_pairs(lines), close_pairs(lines), silhouette_pairs(vertices, faces)])


def test_a_top_that_sank_through_a_plate_comes_back_though_nothing_crosses_any_more():
    vertices, faces = _roof_through_plate()
    z = vertices[:, 2].copy()
    z[121:] -= 0.5
    known, lines = _known(vertices, faces), grid_pairs(Lines(vertices, faces), side=997)
    flat = (lines.upper >= 121).all(axis=1) & (np.ptp(vertices[:, 2][lines.upper], axis=1) == 0.0)
    top = lines.select(flat & (lines.lower < 121).all(axis=1))
    assert len(top) > 100
    assert not out_of_order(known, z).any()
    assert out_of_order(top, z).all()
    laplacian, _ = cotangent_laplacian(vertices, faces)
    found = keep_order(vertices, faces, laplacian, vertex_areas(vertices, faces), z, known)
    assert found.left == 0
    assert not out_of_order(top, found.z).any()


def test_only_what_is_beside_a_crossing_that_is_gone_is_looked_at():
    vertices, faces = _roof_through_plate()
    laplacian, _ = cotangent_laplacian(vertices, faces)
    parted = Parted(vertices, faces, laplacian, Raster(vertices, faces))
    assert len(parted.look_at(vertices[:, 2])) == 0
    z = vertices[:, 2] - np.where(np.arange(len(vertices)) < 121, 0.0, 0.5)
    pairs = parted.look_at(z)
    assert out_of_order(pairs, z).any()
    assert (pairs.gap > 0.0).all()
    assert len(parted.look_at(z)) == 0  # nothing has moved since


def test_one_part_alone_is_not_looked_at():
    vertices, faces = grid(5)
    laplacian, _ = cotangent_laplacian(vertices, faces)
    assert len(Parted(vertices, faces, laplacian, Raster(vertices, faces)).look_at(vertices[:, 2])) == 0
