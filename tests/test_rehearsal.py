import numpy as np
import pytest

import o3d_relief as rel
from o3d_relief.rehearsal import check_scene
from shapes import bust, to_mesh


@pytest.fixture(scope="module")
def scene():
    return to_mesh(bust(20))


REFUSED = [
    ({"k": 5000}, {}),
    ({"k": 8, "beta": (0.1, 0.2)}, {}),
    ({"k": 8, "point_edits": [rel.PointEdit(vertex=5000, action="attach")]}, {}),
    ({"depth": 9.0, "attach": [5000]}, {}),
    ({"depth": 9.0, "weights": [1.0, 2.0]}, {}),
    ({"depth": 1e-9}, {}),
    ({"k": 8}, {"viewpoint": (0.0, 0.0, 1.0)}),
]


@pytest.mark.parametrize(("params", "view"), REFUSED)
def test_the_same_sentence_as_that_of_the_work(scene, params, view):
    params, view = rel.ReliefParams(**params), rel.View(**view)
    with pytest.raises(rel.ReliefError) as of_the_work:
        rel.make_relief(scene, params, view=view)
    with pytest.raises(type(of_the_work.value)) as found:
        check_scene(scene, params, view)
    assert str(found.value) == str(of_the_work.value)


def test_too_many_triangles(scene):
    with pytest.raises(rel.MeshError, match="max_triangles"):
        check_scene(scene, rel.ReliefParams(), rel.View(), 9)


@pytest.mark.parametrize(
    "params",
    [{"k": 8}, {"k": 5000, "depth": "25%"}, {"depth": 9.0, "attach": [3], "weights": [2.0] * 762}],
)
def test_what_can_be_made_is_not_refused(scene, params):
    before = np.array(scene.vertices)
    params = rel.ReliefParams(**params)
    check_scene(scene, params, rel.View())
    assert np.array_equal(scene.vertices, before)
    assert len(rel.make_relief(scene, params).mesh.triangles) > 0
