import numpy as np
import pytest
from solid_bodies import ball, sheet

from o3d_relief.solid.pieces import Piece
from o3d_relief.solid.silhouette import rough_silhouette


def _piece(vertices, faces):
    return Piece(vertices=np.asarray(vertices), faces=np.asarray(faces), source=np.arange(len(vertices)))


def test_a_ball_covers_a_disc():
    mesh = ball(detail=6)
    area = rough_silhouette([_piece(mesh.vertices, mesh.faces)], 0.5).area()
    assert np.pi * 30**2 < area < np.pi * 30.8**2


def test_large_faces_cover_what_they_cover():
    area = rough_silhouette([_piece(*sheet(lambda x, y: 5 + 0 * x, count=3))], 0.1).area()
    assert area == pytest.approx(1600, rel=0.01)
