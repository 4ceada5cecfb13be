import numpy as np
import pytest
import trimesh

from o3d_relief.errors import ParameterError
from o3d_relief.solid.block import solid_under
from o3d_relief.solid.body import Solid
from o3d_relief.solid.heights import height_field
from slabs import ball_on_slab, plate, slab


@pytest.mark.parametrize("colored", [False, True])
def test_solid_under_a_field_has_no_undercut(colored):
    solid = ball_on_slab(colored=colored)
    made = solid_under(height_field(solid, 0.5), solid)
    np.testing.assert_allclose(made.size[:2], solid.size[:2], atol=1e-6)
    assert made.vertices[:, 2].min() == -4.0
    assert made.size[2] == pytest.approx(solid.size[2], abs=0.02)
    assert trimesh.Trimesh(made.vertices, made.faces, process=False).is_watertight
    normals = np.cross(
        made.vertices[made.faces[:, 1]] - made.vertices[made.faces[:, 0]],
        made.vertices[made.faces[:, 2]] - made.vertices[made.faces[:, 0]],
    )
    down = normals[:, 2] < -1e-9
    assert (made.vertices[made.faces[down]][..., 2] == -4.0).all()  # only the back faces away
    # The shadow of the ball is filled: a cylinder below its upper half.
    disc = np.pi * 10.0**2
    wanted = 60 * 40 * 4 + 8 * disc + 2 / 3 * disc * 10
    assert made.volume == pytest.approx(wanted, rel=3e-3)
    assert (made.colors is not None) == colored


@pytest.mark.parametrize("colored", [False, True])
def test_field_of_the_solid_under_a_field_is_the_field(colored):
    solid = ball_on_slab(colored=colored)
    field = height_field(solid, 0.5)
    again = height_field(solid_under(field, solid), 0.5)
    assert again.z.shape == field.z.shape
    assert np.abs(again.z - field.z).max() < 0.01  # flat to a hundredth of a pixel, 0.005
    assert (again.is_plate != field.is_plate).mean() < 0.01  # but at the rim of the ball
    if colored:
        same = again.is_plate == field.is_plate
        np.testing.assert_allclose(again.colors[same], field.colors[same], atol=0.02)


def test_outline_is_cut_exactly():
    corner = Solid.from_manifold(plate().trim_by_plane([-1.0, -1.0, 0.0], -10.0), colored=False)
    made = solid_under(height_field(corner, 1.0), corner)
    assert made.volume == pytest.approx(corner.volume, rel=1e-6)
    np.testing.assert_allclose(made.size, corner.size, atol=1e-6)


def test_a_solid_that_needs_too_much_memory_is_refused(monkeypatch):
    field = height_field(slab(), 0.05)
    monkeypatch.setattr("o3d_relief.limits.available_memory", lambda: 2**29)
    with pytest.raises(ParameterError, match=r"0\.05 makes 1200 x 800 .* 1\.1 GB of memory and 0\.5 GB are"):
        solid_under(field, slab())
