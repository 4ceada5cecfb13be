import pytest

import o3d_relief as rel
from o3d_relief.bounds.near_points import NearPoints
from shapes import bust, to_mesh


def _bends(relief, stage):
    s = relief.stages
    vertices, faces = s["perspective"].vertices, s["scene"].faces
    around = NearPoints(vertices, faces, s["visibility"].visible, s["attenuation"].kept_index)
    return around.bends.most(s[stage].z)


@pytest.mark.parametrize("beta", [0.05, 0.8])
def test_points_bend_less_than_the_rest(beta):
    relief = rel.make_relief(to_mesh(bust(60)), rel.ReliefParams(k=64, beta=beta))
    near, elsewhere = _bends(relief, "restoration")
    assert near <= elsewhere
    assert relief.stages["restoration"].stiffness > 0.0
    assert relief.certificate.faces_near_points > 5
    assert relief.certificate.failures == []


def test_pimples_stay_where_they_are_not_asked_to_go():
    relief = rel.make_relief(to_mesh(bust(60)), rel.ReliefParams(k=64, smooth_points=False))
    near, elsewhere = _bends(relief, "construction")
    assert near > elsewhere
    assert relief.stages["restoration"].stiffness == 0.0
