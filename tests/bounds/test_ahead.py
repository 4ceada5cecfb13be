import numpy as np
import pytest

from o3d_relief import cotangent_laplacian
from o3d_relief.bounds.ahead import Ahead
from o3d_relief.bounds.columns import column_pairs
from o3d_relief.bounds.lines import Lines
from o3d_relief.bounds.pairs import Pairs, close_pairs, vertex_pairs
from o3d_relief.bounds.silhouettes import silhouette_pairs
from o3d_relief.linalg.laplacian import vertex_areas
from o3d_relief.threads import one_beside
from shapes import bust, grid, joined, moved


@pytest.mark.parametrize(("fine", "side"), [(False, 256), (True, 1024)])
def test_all_is_found_as_by_whoever_needs_it(fine, side):
    vertices, faces = joined(grid(15, size=80), moved(bust(14), (0, 0, 40)))
    laplacian, _ = cotangent_laplacian(vertices, faces)
    lines = Lines(vertices, faces)
    with one_beside() as thread:
        ahead = Ahead(thread, vertices, faces)
        stacked = vertex_pairs(lines)
        ahead.stack(lines, stacked, laplacian, fine=fine)
        found, areas, between = ahead.pairs, ahead.areas, ahead.between
    own = Lines(vertices, faces)
    wanted = Pairs.join(
        [
            vertex_pairs(own),
            silhouette_pairs(vertices, faces),
            close_pairs(own),
            column_pairs(own, side=side),
        ]
    )
    assert len(wanted) > len(stacked) > 0
    for name, value in vars(wanted).items():
        assert value.tobytes() == getattr(found, name).tobytes()
    assert (areas == vertex_areas(vertices, faces)).all()
    assert between.look_at(vertices[:, 2] + 1.0)[1] == 0
    assert between.look_at(np.where(vertices[:, 2] > 20.0, vertices[:, 2] - 45.0, 10.0))[1] > 0
