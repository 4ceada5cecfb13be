import numpy as np
import pytest
from scipy.sparse.csgraph import connected_components

from o3d_relief import cotangent_laplacian
from o3d_relief.bounds.lines import Lines
from o3d_relief.bounds.pairs import vertex_pairs
from o3d_relief.bounds.parts import find_springs
from o3d_relief.live_construction import LiveConstruction
from o3d_relief.stages.attenuation import attenuate
from o3d_relief.stages.construction import construct
from shapes import hills, joined, moved, sphere

# Small balls in front of a large surface.
PARTS = joined(
    hills(31),
    *(
        moved((0.12 * v, f), (25 * i - 60, 20 * i - 50, 40 + 5 * i))
        for i, (v, f) in enumerate([sphere(8)] * 6)
    ),
)
EXTENT = 100.0


def _expected(vertices, laplacian, index, kept, height, springs, shrink):
    ties = None
    if springs is not None:
        label = _labels(laplacian)
        ties = springs.ties(np.isin(label, label[index[kept]]), shrink)
    return construct(
        vertices,
        laplacian,
        index[kept],
        height[kept],
        among_held=None if ties is None else (ties.among_held, ties.among_held_pull),
        to_loose=None if ties is None else (ties.to_loose, ties.to_loose_pull),
    ).z


def _labels(laplacian):
    return connected_components(laplacian, directed=False)[1]


@pytest.mark.parametrize("tied", [False, True])
@pytest.mark.parametrize("shape", [hills(31), PARTS], ids=["one part", "parts"])
def test_equal_to_the_construction_of_the_pipeline(shape, tied):
    vertices, faces = shape
    laplacian, _ = cotangent_laplacian(vertices, faces)
    springs = find_springs(vertices, faces, laplacian, vertex_pairs(Lines(vertices, faces))) if tied else None
    rng = np.random.default_rng(0)
    label = _labels(laplacian)
    # Six points on the large part, one on each of the small ones but two.
    index = np.concatenate(
        [rng.choice(np.flatnonzero(label == 0), 6, replace=False)]
        + [np.flatnonzero(label == part)[:1] for part in range(1, max(label.max() - 1, 1))]
    )
    live = LiveConstruction(vertices, laplacian, index, springs)
    if springs is not None:
        assert len(springs.stacked) > 0
    p = len(index)
    choices = [np.ones(p, dtype=bool), *(rng.random((6, p)) < 0.6)]
    choices += [choices[0], choices[1]]
    for number, kept in enumerate(choices):
        kept[number % 2] = True
        height = np.where(kept, rng.uniform(0, 30, p), np.nan)
        shrink = None if springs is None else attenuate(springs.stacked.gap, np.array(0.01 + 0.2 * number))
        found = live.heights(kept, height, shrink)
        expected = _expected(vertices, laplacian, index, kept, height, springs, shrink)
        assert np.abs(found - expected).max() < 1e-6 * EXTENT
        assert (found[index[kept]] == height[kept]).all()
