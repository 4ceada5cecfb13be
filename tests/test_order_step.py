import numpy as np

import o3d_relief as rel
from o3d_relief.bounds.near_points import NearPoints
from shapes import bust, grid, joined, moved, to_mesh


def _layers():
    """Two bodies and a plate, closely one before the other: the order has much to correct."""
    plate, faces = grid(41, size=120)
    return joined((plate, faces), moved(bust(24), (-12, 5, 60)), moved(bust(24), (10, -4, 180)))


def _relief(**params):
    return rel.make_relief(to_mesh(_layers()), rel.ReliefParams(k=64, beta=0.8, **params))


def test_corrections_bend_the_surface_elsewhere_than_at_the_points():
    relief = _relief()
    s = relief.stages
    assert s["order"].counts["pairs_corrected"] > 0
    assert s["order"].counts["left"] == 0
    points = s["attenuation"].kept_index
    around = NearPoints(s["perspective"].vertices, s["scene"].faces, s["visibility"].visible, points)
    near, elsewhere = around.bends.most(s["order"].z)
    assert near <= elsewhere
    assert relief.certificate.failures == []


def test_without_it_nothing_moves():
    stages = _relief(in_order=False).stages
    assert np.abs(stages["order"].z - stages["restoration"].z).max() < 1e-8
    assert stages["order"].counts == {}


def test_gaps_are_kept_everywhere():
    certificate = _relief(min_gap=1.0).certificate
    assert certificate.gaps_tested > 10_000
    assert certificate.gaps_missed == 0
