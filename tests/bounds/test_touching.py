import numpy as np

from o3d_relief.bounds.touching import touching_pairs
from shapes import grid, joined, moved


def test_touching_parts_are_found_whichever_way_they_lie():
    base = grid(5, size=20)
    parts = [moved(grid(3, size=4), (0, 0, 0.05)), moved(grid(3, size=4), (0, 0, 3))]
    side = grid(3, size=4)[0][:, [2, 1, 0]] + [10.05, 0, 0], grid(3, size=4)[1]
    vertices, faces = joined(base, *parts, side)
    label = np.repeat([0, 1, 2, 3], [25, 9, 9, 9])
    pairs = touching_pairs(vertices, faces, label, 0.1)
    met = {
        tuple(sorted(pair)) for pair in zip(label[pairs.upper[:, 0]], label[pairs.lower[:, 0]], strict=True)
    }
    assert met == {(0, 1), (0, 3)}
    assert (pairs.gap <= 0.1).all()
