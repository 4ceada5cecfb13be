import numpy as np
import pytest
import trimesh

from o3d_relief.errors import ParameterError
from o3d_relief.solid.body import PLATE_COLOR, Solid
from o3d_relief.solid.heights import HeightField, check_pixels, height_field, solid_under
from shapes import bust
from slabs import ball_on_slab, plain, plate, slab


def test_heights_of_a_ball_are_its_upper_half():
    field = height_field(ball_on_slab(), 0.5)
    rows, columns = field.z.shape
    assert (columns, rows) == (120, 80)
    x = field.left + (np.arange(columns) + 0.5) * 0.5
    y = field.top - (np.arange(rows) + 0.5) * 0.5
    assert (x[0], y[0]) == (-29.75, 19.75)
    squared = (x - 3.0) ** 2 + (y[:, None] - 2.0) ** 2
    on_ball, clear = squared < 9.5**2, squared > 10.1**2
    wanted = 8.0 + np.sqrt(100.0 - squared[on_ball])
    assert np.abs(field.z[on_ball] - wanted).max() < 0.06  # a polyhedron of 96 sides
    assert (field.z[clear] == 0.0).all()
    assert field.is_plate[clear].all()
    assert not field.is_plate[on_ball].any()
    assert field.back == -4.0


def test_pixels_cover_the_piece_whatever_their_size():
    field = height_field(slab(), 0.7)
    assert field.z.shape == (58, 86)
    assert field.inside.all()
    assert field.left == pytest.approx(-86 * 0.35)
    assert field.top == pytest.approx(58 * 0.35)


def test_pixels_beside_the_piece_are_empty():
    corner = plate().trim_by_plane([-1.0, -1.0, 0.0], -10.0)
    field = height_field(Solid.from_manifold(corner, colored=False), 1.0)
    x = field.left + np.arange(field.z.shape[1]) + 0.5
    y = field.top - np.arange(field.z.shape[0]) - 0.5
    where = x + y[:, None]
    assert field.inside[where < 14.0].all()
    assert not field.inside[where > 14.2].any()


def test_colours_are_those_of_the_surface_that_is_seen():
    solid = ball_on_slab(colored=True)
    field = height_field(solid, 0.5)
    i, j = 40 - 4, 60 + 6  # in front of the centre of the ball, (3, 2), within half a pixel
    np.testing.assert_allclose(field.colors[i, j], 0.5 + 0.045 * np.array([0.0, 0.0, 10.0]), atol=0.03)
    assert (field.colors[field.is_plate] == PLATE_COLOR).all()


def test_heights_agree_with_another_ray_caster():
    vertices, faces = bust(16)
    solid = Solid.from_manifold(plain_of(vertices, faces), colored=False)
    field = height_field(solid, 3.0)
    mesh = trimesh.Trimesh(solid.vertices, solid.faces, process=False)
    rows, columns = field.z.shape
    x = field.left + (np.arange(columns) + 0.5) * 3.0
    y = field.top - (np.arange(rows) + 0.5) * 3.0
    origins = np.stack([np.tile(x, rows), np.repeat(y, columns), np.full(rows * columns, 200.0)], axis=1)
    corners = mesh.vertices[mesh.faces]
    highest = np.full(rows * columns, np.nan)
    for a, b, c in corners:  # the literal way: every triangle against every ray
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if area <= 0.0:
            continue
        p, q = origins[:, 0], origins[:, 1]
        u = ((b[0] - p) * (c[1] - q) - (b[1] - q) * (c[0] - p)) / area
        v = ((c[0] - p) * (a[1] - q) - (c[1] - q) * (a[0] - p)) / area
        w = 1.0 - u - v
        hit = (u >= 0) & (v >= 0) & (w >= 0)
        highest[hit] = np.fmax(highest[hit], (u * a[2] + v * b[2] + w * c[2])[hit])
    same = np.isfinite(highest) & field.inside.ravel()
    assert (np.isfinite(highest) ^ field.inside.ravel()).sum() <= 2  # rays along the outline
    assert np.quantile(np.abs(field.z.ravel() - highest)[same], 0.99) < 1e-3


def plain_of(vertices, faces):
    from o3d_relief.solid.body import manifold_of

    return manifold_of(vertices, faces, is_plate=False)


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


def test_field_of_the_solid_under_a_field_is_the_field():
    solid = ball_on_slab()
    field = height_field(solid, 0.5)
    again = height_field(solid_under(field, solid), 0.5)
    assert again.z.shape == field.z.shape
    assert np.abs(again.z - field.z).max() < 0.01  # flat to a hundredth of a pixel, 0.005


def test_outline_is_cut_exactly():
    corner = Solid.from_manifold(plate().trim_by_plane([-1.0, -1.0, 0.0], -10.0), colored=False)
    made = solid_under(height_field(corner, 1.0), corner)
    assert made.volume == pytest.approx(corner.volume, rel=1e-6)
    np.testing.assert_allclose(made.size, corner.size, atol=1e-6)


def test_with_heights_keeps_everything_else():
    field = height_field(slab(), 2.0)
    raised = field.with_heights(field.z + 1.0)
    assert (raised.z == field.z + 1.0).all()
    assert isinstance(raised, HeightField)
    assert raised.mm_per_pixel == field.mm_per_pixel
    assert "30 x 20 pixels of 2 mm" in repr(raised)
    with pytest.raises(ValueError, match="read-only"):
        raised.z[0, 0] = 1.0


@pytest.mark.parametrize(
    ("pixel", "sentence"), [(0.001, "must be larger"), (500.0, "smaller than the piece")]
)
def test_pixels_that_do_not_fit_are_refused(pixel, sentence):
    solid = Solid.from_manifold(plain_of(*_ring()), colored=False) if pixel > 1 else slab()
    with pytest.raises(ParameterError, match=sentence):
        height_field(solid, pixel)


def _ring():
    """A frame around an empty middle, which is all that a large pixel sees."""
    import manifold3d

    ring = manifold3d.Manifold.cube([60, 40, 4], True) - manifold3d.Manifold.cube([50, 30, 9], True)
    mesh = ring.to_mesh64()
    return np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts).astype(np.int64)


def test_plain_helper_is_a_plate():
    assert plain(plate()).volume() == pytest.approx(9600.0)


def test_a_solid_that_needs_too_much_memory_is_refused(monkeypatch):
    field = height_field(slab(), 0.05)
    monkeypatch.setattr("o3d_relief.limits.available_memory", lambda: 2**29)
    with pytest.raises(ParameterError, match=r"0\.05 makes 1200 x 800 .* 1\.1 GB of memory and 0\.5 GB are"):
        solid_under(field, slab())


def test_pixels_of_a_piece():
    assert check_pixels(30.0, 20.1, 0.1) == (300, 201)
    assert check_pixels(0.0, 1.0, 2.0) == (1, 1)
    with pytest.raises(
        ParameterError, match="makes 200000 x 1000 pixels of this piece, more than 40,000,000"
    ):
        check_pixels(2000.0, 10.0, 0.01)
    with pytest.raises(ParameterError, match="makes about 200000 x 1000 pixels"):
        check_pixels(2000.0, 10.0, 0.01, about=True)
