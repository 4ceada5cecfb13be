import numpy as np
import pytest
from solid_bodies import ball, sheet

from o3d_relief.solid.chain import boundary, volume
from o3d_relief.solid.orient import oriented
from o3d_relief.solid.pieces import Piece
from o3d_relief.solid.thicken import charts, room_behind, shells


def _piece(vertices, faces):
    return Piece(vertices=np.asarray(vertices), faces=np.asarray(faces), source=np.arange(len(vertices)))


def test_a_flat_sheet_becomes_a_slab():
    (slab,) = shells(_piece(*sheet(lambda x, y: 5 + 0 * x)), 1.5)
    assert len(boundary(slab.faces)) == 0
    assert volume(slab.vertices, slab.faces) == pytest.approx(40 * 40 * 1.5)
    assert slab.vertices[:, 2].max() == 5.0
    assert slab.vertices[:, 2].min() == pytest.approx(3.5)
    assert slab.source.max() == 143


def test_an_open_box_is_taken_apart_at_its_edges():
    from trimesh.creation import box

    mesh = box(extents=[20, 20, 20])
    open_box = _piece(np.array(mesh.vertices), np.array(mesh.faces)[mesh.face_normals[:, 2] > -0.5])
    label = charts(open_box)
    assert label.max() + 1 == 5
    assert np.bincount(label).tolist() == [2] * 5
    slabs = shells(open_box, 1.0)
    assert all(len(boundary(slab.faces)) == 0 for slab in slabs)
    # Mitred: the sheets meet without a gap and without covering anything twice.
    assert sum(volume(slab.vertices, slab.faces) for slab in slabs) == pytest.approx(8000 - 18 * 18 * 19)


def test_a_ball_is_taken_apart_into_six():
    mesh = ball()
    assert charts(_piece(np.array(mesh.vertices), np.array(mesh.faces))).max() + 1 == 6


def test_walls_leave_room_for_each_other():
    front = sheet(lambda x, y: 5 + 0 * x, count=4)
    back = sheet(lambda x, y: 4 + 0 * x, count=4)
    both = _piece(np.concatenate([front[0], back[0]]), np.concatenate([front[1], back[1][:, ::-1] + 16]))
    assert room_behind(both) == pytest.approx(np.ones(32), abs=1e-3)
    slabs = shells(both, 3.0)
    assert [volume(slab.vertices, slab.faces) for slab in slabs] == pytest.approx([0.55 * 1600] * 2, rel=1e-3)


def test_a_mixed_patch_is_turned_outward():
    mesh = ball()
    faces = np.array(mesh.faces)
    good = volume(np.array(mesh.vertices), faces)
    half = np.random.default_rng(1).random(len(faces)) < 0.7
    piece, turned = oriented(_piece(np.array(mesh.vertices), np.where(half[:, None], faces[:, ::-1], faces)))
    assert volume(piece.vertices, piece.faces) == pytest.approx(good)
    assert turned == half.sum()


def test_a_patch_of_many_faces_is_turned_outward_by_some_of_them():
    from trimesh.creation import icosphere

    # A hollow ball, seen from inside but for one face: few rays from its inside get away through the hole.
    mesh = icosphere(subdivisions=5, radius=10.0)
    faces = np.array(mesh.faces)[mesh.triangles_center[:, 2] < 8.0]
    inward = faces[:, ::-1].copy()
    inward[7] = faces[7]
    piece, turned = oriented(_piece(np.array(mesh.vertices), inward))
    assert len(faces) > 4 * 2048
    assert turned == len(faces) - 1
    assert np.array_equal(piece.faces, faces)


@pytest.mark.parametrize(("bend", "turned"), [(2e-3, -1), (-2e-3, 1)])
def test_the_outside_of_a_sheet_is_its_hill(bend, turned):
    # Nearly as free on both sides.
    vertices, faces = sheet(lambda x, y: 5 + bend * x**2, count=100)
    mixed = np.array(faces)
    mixed[-1] = mixed[-1, ::-1]
    piece, count = oriented(_piece(vertices, mixed))
    assert len(faces) > 4 * 2048
    assert count == turned % len(faces)
    assert np.array_equal(piece.faces, faces if turned == 1 else np.array(faces)[:, ::-1])


def test_a_moebius_strip_stays_as_it_is():
    around = np.arange(24)
    angle = 2 * np.pi * around / 24
    out = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    across = np.cos(angle / 2)[:, None] * out + np.sin(angle / 2)[:, None] * [0, 0, 1]
    vertices = np.concatenate([30 * out - 5 * across, 30 * out + 5 * across])
    following = np.where(around == 23, 24, around + 1)
    partner = np.where(around == 23, 0, around + 25)
    faces = np.concatenate(
        [np.stack([around, following, around + 24], 1), np.stack([following, partner, around + 24], 1)]
    )
    piece, turned = oriented(_piece(vertices, faces))
    assert turned == 0
    assert np.array_equal(piece.faces, faces)
    for shell in shells(piece, 1.0):
        assert len(boundary(shell.faces)) == 0
