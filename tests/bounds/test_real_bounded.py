"""The bounded mode on real meshes: as deep as asked for, and clean."""

from functools import cache

import numpy as np
import pytest

import o3d_relief as rel
from real_meshes import VIEWS, real_view

pytestmark = [pytest.mark.data, pytest.mark.slow]

# The second file of igea holds the triangles of the first (tests/scene/test_read.py compares them). The city,
# with its 1,890 parts, is too much for a test.
MESHES = [name for name in VIEWS if "city" not in name and "tristrips" not in name]


@cache
def _visible_depth(path, view):
    """Return the depth of what is visible of a scene, found by the quickest of all reliefs."""
    return rel.make_relief(rel.read_mesh(path), rel.ReliefParams.paper(k=1), view=view).summary()[
        "scene_visible_depth"
    ]


KNOWN = {("dragon_full_871k.ply", 0.1): "one pair of 270,240 changes places, and the search does not see it"}
"""Where the certificate finds one inversion; whatever else it finds there fails the test."""


@pytest.mark.parametrize("share", [0.5, 0.25, 0.1, 0.05])
@pytest.mark.parametrize("name", MESHES)
def test_bounded_reliefs_are_as_deep_as_asked_for_and_clean(data_folder, name, share):
    path, view = data_folder / name, real_view(name)
    depth = share * _visible_depth(path, view)
    relief = rel.make_relief(rel.read_mesh(path), rel.ReliefParams(depth=depth), view=view)
    assert np.asarray(relief.mesh.vertices)[:, 2].max() == pytest.approx(depth, rel=1e-3)
    certificate = relief.certificate
    inverted = certificate.vertex_inversions + certificate.grid_inversions
    if (name, share) in KNOWN and inverted == len(certificate.failures) == 1:
        pytest.xfail(KNOWN[name, share])
    assert certificate.failures == []
    assert relief.stages["bounded"].energy_gap <= 0.03
