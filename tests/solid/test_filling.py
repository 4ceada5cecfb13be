import numpy as np
import pytest
from solid_bodies import ball, sheet

from o3d_relief.solid.chain import boundary, volume
from o3d_relief.solid.filling import filled_behind, followed
from o3d_relief.solid.pieces import Piece


def _piece(vertices, faces):
    return Piece(vertices=np.asarray(vertices), faces=np.asarray(faces), source=np.arange(len(vertices)))


def _together(*parts):
    start = np.cumsum([0, *[len(vertices) for vertices, _ in parts]])
    return _piece(
        np.concatenate([vertices for vertices, _ in parts]),
        np.concatenate([faces + first for (_, faces), first in zip(parts, start, strict=False)]),
    )


def _volume(piece, floor=-1.0):
    pieces = filled_behind(piece, floor)
    assert all(len(boundary(part.faces)) == 0 for part in pieces)
    return sum(volume(part.vertices, part.faces) for part in pieces)


def test_nothing_is_behind_what_stands_upright():
    vertices = np.array([[0.0, 0, 1], [4, 0, 1], [4, 0, 3], [0, 0, 3]])
    assert filled_behind(_piece(vertices, [[0, 1, 2], [0, 2, 3]]), -1.0) == []


def test_a_sheet_stands_on_the_floor():
    assert _volume(_piece(*sheet(lambda x, y: 5 + 0 * x))) == pytest.approx(1600 * 6)


def test_air_behind_a_closed_part_stays():
    mesh = ball((0, 0, 50), 20.0)
    assert _volume(_piece(mesh.vertices, mesh.faces)) == pytest.approx(mesh.volume)


def test_half_a_ball_goes_on_to_the_floor():
    mesh = ball((0, 0, 50), 20.0, detail=5)
    front = np.array(mesh.faces)[mesh.face_normals[:, 2] > 0.0]
    pieces = filled_behind(_piece(mesh.vertices, front), -1.0)
    found = sum(volume(part.vertices, part.faces) for part in pieces)
    assert found == pytest.approx(mesh.volume / 2 + np.pi * 20**2 * 51, rel=2e-3)


def test_what_a_sheet_hides_is_inside_it():
    hidden = _together(sheet(lambda x, y: 8 + 0 * x), sheet(lambda x, y: 3 + 0 * x, size=20.0))
    assert followed(hidden).kept[-len(hidden.faces) // 2 :].max() == 0
    assert _volume(hidden) == pytest.approx(1600 * 9)


def test_a_sheet_seen_from_its_wrong_side_is_entered():
    vertices, faces = sheet(lambda x, y: 5 + 0 * x)
    assert _volume(_piece(vertices, faces[:, ::-1])) == pytest.approx(1600 * 6)


def test_a_step_is_closed_where_the_front_ends():
    # A small sheet before a large one: the large one is torn at its outline, and the gap is closed.
    step = _together(
        sheet(lambda x, y: 8 + 0 * x, size=13.3, count=20), sheet(lambda x, y: 2 + 0 * x, count=60)
    )
    assert _volume(step) == pytest.approx(13.3**2 * 9 + (1600 - 13.3**2) * 3, rel=0.01)
