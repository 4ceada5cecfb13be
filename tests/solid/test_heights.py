import copy
import pickle
from dataclasses import fields, replace

import numpy as np
import pytest
import trimesh

from o3d_relief.errors import ParameterError
from o3d_relief.solid.body import PLATE_COLOR, Solid
from o3d_relief.solid.heights import HeightField, check_pixels, height_field
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


def test_field_moves_with_the_piece():
    solid, way = ball_on_slab(colored=True), np.array([7.0, -30.0, 2.5])
    field, moved = (
        height_field(replace(solid, vertices=solid.vertices + by), 0.5) for by in (0.0 * way, way)
    )
    np.testing.assert_allclose(moved.z, field.z + 2.5, atol=1e-4)
    np.testing.assert_allclose(moved.colors, field.colors, atol=1e-4)
    assert (moved.left, moved.top) == (field.left + 7.0, field.top - 30.0)
    assert (moved.back, moved.highest) == (-1.5, field.highest + 2.5)


def test_no_face_is_looked_through():
    solid = slab()
    for first in range(len(solid.faces)):
        faces, is_plate = np.roll(solid.faces, first, axis=0), np.roll(solid.is_plate, first)
        assert height_field(replace(solid, faces=faces, is_plate=is_plate), 2.0).inside.all()


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


def test_pickling_and_copying_keep_the_class_and_arrays_read_only():
    solid = slab()
    field = height_field(solid, 2.0)
    for thing in (solid, field):
        own = type("Own", (type(thing),), {})(
            **{item.name: getattr(thing, item.name) for item in fields(thing)}
        )
        assert type(copy.copy(own)) is type(own)
        for again in (pickle.loads(pickle.dumps(thing)), copy.deepcopy(thing)):
            for item in fields(thing):
                value, other = getattr(thing, item.name), getattr(again, item.name)
                np.testing.assert_equal(other, value)
                assert not isinstance(value, np.ndarray) or not other.flags.writeable


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
    ("pixel", "sentence"),
    [
        (0.001, "must be larger"),
        (500.0, "smaller than the piece"),
        (0.0, "must be greater than 0"),
        (-1.0, "must be greater than 0"),
        (float("nan"), "must be finite"),
        (None, "must be a number"),
    ],
)
def test_pixels_that_do_not_fit_are_refused(pixel, sentence):
    solid = Solid.from_manifold(plain_of(*_ring()), colored=False) if pixel == 500.0 else slab()
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


def test_pixels_of_a_piece():
    assert check_pixels(30.0, 20.1, 0.1) == (300, 201)
    assert check_pixels(0.0, 1.0, 2.0) == (1, 1)
    with pytest.raises(
        ParameterError, match="makes 200000 x 1000 pixels of this piece, more than 40,000,000"
    ):
        check_pixels(2000.0, 10.0, 0.01)
    with pytest.raises(ParameterError, match="makes about 200000 x 1000 pixels"):
        check_pixels(2000.0, 10.0, 0.01, about=True)
