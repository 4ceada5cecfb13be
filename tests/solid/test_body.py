import manifold3d
import numpy as np
import pytest
import trimesh

from o3d_relief.errors import MeshError
from o3d_relief.solid.body import PLATE_COLOR, Solid, manifold_of


def _sphere(radius=1.0, colors=None, plate=False):
    ball = trimesh.creation.icosphere(2, radius)
    return manifold_of(np.array(ball.vertices), np.array(ball.faces), colors=colors, is_plate=plate)


def test_a_union_keeps_colours_and_the_seam():
    red = np.tile([1.0, 0.0, 0.0], (162, 1))
    box = manifold_of(*_box([-2, -2, -1], [2, 2, 0]), is_plate=True)
    solid = Solid.from_manifold(_sphere(colors=red) + box, colored=True)
    mesh = trimesh.Trimesh(solid.vertices, solid.faces, process=False)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert solid.volume == pytest.approx(mesh.volume)
    assert solid.size == pytest.approx([4, 4, 2])
    middle = solid.vertices[solid.faces].mean(axis=1)
    assert np.array_equal(~solid.is_plate, (middle[:, 2] > 1e-9))
    assert np.array_equal(solid.corner_colors()[solid.is_plate][0], np.tile(PLATE_COLOR, (3, 1)))
    assert (solid.corner_colors()[~solid.is_plate] == [1, 0, 0]).all()
    assert not solid.vertices.flags.writeable


def test_there_and_back():
    red = np.tile([1.0, 0.0, 0.0], (162, 1))
    box = manifold_of(*_box([-2, -2, -1], [2, 2, 0]), is_plate=True)
    solid = Solid.from_manifold(_sphere(colors=red) + box, colored=True)
    again = Solid.from_manifold(solid.to_manifold(), colored=True)
    assert again.volume == pytest.approx(solid.volume, rel=1e-12)
    assert again.is_plate.sum() == solid.is_plate.sum()
    cut = solid.to_manifold().trim_by_plane((0, 0, 1), -0.5)
    assert Solid.from_manifold(cut, colored=False).colors is None
    assert Solid.from_manifold(cut, colored=False).size[2] == pytest.approx(1.5)


def test_no_solid():
    with pytest.raises(MeshError, match="not a closed manifold"):
        manifold_of(np.eye(3), np.array([[0, 1, 2]]), is_plate=True)
    with pytest.raises(MeshError, match="No solid is left"):
        Solid.from_manifold(manifold3d.Manifold(), colored=False)


def _box(low, high):
    box = trimesh.creation.box(bounds=[low, high])
    return np.array(box.vertices), np.array(box.faces)
