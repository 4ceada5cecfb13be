import numpy as np

from o3d_relief.bounds.raster import Raster
from shapes import grid, joined, moved


def test_what_lies_over_or_under_what_changed_is_found_whatever_its_height():
    vertices, faces = joined(grid(3, size=20.0), moved(grid(3, size=20.0), (0.0, 0.0, 30.0)))
    vertices, faces = joined((vertices, faces), moved(grid(3, size=20.0), (300.0, 0.0, 0.0)))
    changed = np.arange(len(faces)) < 8
    found = Raster(vertices, faces).over_or_under(changed)
    assert found[:16].all()
    assert not found[16:].any()
    assert not Raster(vertices, faces).over_or_under(np.zeros(len(faces), dtype=bool)).any()
