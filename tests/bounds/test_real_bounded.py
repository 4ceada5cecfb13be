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


@pytest.mark.parametrize("share", [0.5, 0.25, 0.1, 0.05])
@pytest.mark.parametrize("name", MESHES)
def test_bounded_reliefs_are_as_deep_as_asked_for_and_clean(data_folder, name, share):
    path, view = data_folder / name, real_view(name)
    depth = share * _visible_depth(path, view)
    relief = rel.make_relief(rel.read_mesh(path), rel.ReliefParams(depth=depth), view=view)
    assert np.asarray(relief.mesh.vertices)[:, 2].max() == pytest.approx(depth, rel=1e-3)
    assert relief.certificate.failures == []
    assert relief.stages["bounded"].energy_gap <= 0.03
