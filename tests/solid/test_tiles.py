import copy
import pickle

import manifold3d
import numpy as np
import open3d as o3d
import pytest
import trimesh

from o3d_relief.errors import ParameterError
from o3d_relief.plate_params import PlateParams
from o3d_relief.solid.body import PLATE_COLOR, Solid
from o3d_relief.solid.fragments import held
from o3d_relief.solid.numerals import engraving
from o3d_relief.solid.plate import pockets
from o3d_relief.solid.tiles import Tiling, make_tiles
from o3d_relief.workshop_params import TileParams
from slabs import ball_on_slab, plain, plate, slab

EXACT = {"clearance_mm": 0.0, "number": False}


def _united(tiling):
    parts = [tile.solid.to_manifold() for tile in tiling.tiles]
    return manifold3d.Manifold.batch_boolean(parts, manifold3d.OpType.Add)


@pytest.fixture(scope="module")
def large():
    """330 x 200 mm and 6 thick, with a ball over the place where four tiles meet."""
    ball = plain(manifold3d.Manifold.sphere(40.0, 64).translate([5.0, -3.0, 20.0]), is_plate=False)
    # Nothing reaches through the back.
    ball = ball - plain(manifold3d.Manifold.cube([200, 200, 50]).translate([-100, -100, -56.0]))
    return Solid.from_manifold(plate(330.0, 200.0, 6.0) + ball, colored=False)


@pytest.fixture(scope="module")
def hung():
    """300 x 200 mm and 6 thick, a keyhole in the middle of its back."""
    params = PlateParams(shape="rectangle", base_mm=6.0, hanging="keyhole")
    outline = manifold3d.CrossSection.square((300.0, 200.0), True)
    return Solid.from_manifold(plate(300.0, 200.0, 6.0) - pockets(outline, params), colored=False)


@pytest.mark.parametrize(
    ("width", "height", "cut"), [(160, 210, 1), (310, 18, 1), (120, 210, 0), (310, 210, 0)]
)
def test_seams_through_a_keyhole_are_counted(hung, width, height, cut):
    assert make_tiles(hung, TileParams(width_mm=width, height_mm=height)).counts["pockets_cut"] == cut


def test_a_back_without_a_hole_has_none_to_cut(large):
    counts = make_tiles(large, TileParams(width_mm=170, height_mm=120)).counts
    assert (counts["tiles"], counts["pockets_cut"]) == (4, 0)


def test_tiles_are_closed_and_fit_the_printer(large):
    tiling = make_tiles(large, TileParams(width_mm=170, height_mm=120))
    assert [tile.number for tile in tiling.tiles] == [1, 2, 3, 4]
    assert [(tile.row, tile.column) for tile in tiling.tiles] == [(0, 0), (0, 1), (1, 0), (1, 1)]
    for tile in tiling.tiles:
        mesh = trimesh.Trimesh(tile.solid.vertices, tile.solid.faces, process=False)
        assert mesh.is_watertight
        assert mesh.is_winding_consistent
        assert mesh.volume > 0
        assert tile.solid.to_manifold().status() == manifold3d.Error.NoError
        assert (tile.solid.size[:2] <= [170.0, 120.0]).all()
    # The upper left tile: half of the piece, with its pins on the right; x to the right, y up.
    np.testing.assert_allclose(tiling.tiles[0].solid.size[:2], [165.0 + 4.5, 100.0], atol=1e-9)
    np.testing.assert_allclose(tiling.tiles[2].solid.size[:2], [165.0 + 4.5, 100.0 + 4.5], atol=1e-9)
    np.testing.assert_allclose(tiling.tiles[3].solid.size[:2], [165.0, 104.5], atol=1e-9)
    assert tiling.tiles[0].solid.vertices[:, 1].max() == pytest.approx(100.0)


def test_tiles_survive_pickling_and_copying(large):
    tiling = make_tiles(large, TileParams(width_mm=170, height_mm=120))
    for again in (pickle.loads(pickle.dumps(tiling)), copy.deepcopy(tiling)):
        assert again.counts == tiling.counts
        for one, other in zip(again.tiles, tiling.tiles, strict=True):
            assert (one.number, one.pins) == (other.number, other.pins)
            assert np.array_equal(one.solid.vertices, other.solid.vertices)

    class Own(Tiling):
        pass

    assert type(copy.copy(Own(tiles=tiling.tiles, pin_mm=4.0, pin_length_mm=4.0))) is Own


def test_pins_count_for_the_size_of_a_tile():
    assert make_tiles(slab(200.0, 40.0), TileParams(width_mm=103, height_mm=60)).counts["columns"] == 2
    assert make_tiles(slab(200.0, 40.0), TileParams(width_mm=102, height_mm=60)).counts["columns"] == 3
    assert make_tiles(slab(200.0, 40.0), TileParams(width_mm=200, height_mm=40)).counts["tiles"] == 1


def test_without_clearance_the_tiles_are_the_whole(large):
    tiling = make_tiles(large, TileParams(width_mm=120, height_mm=120, **EXACT))
    volumes = [tile.solid.volume for tile in tiling.tiles]
    assert sum(volumes) == pytest.approx(large.volume, rel=1e-9)  # every pin fills its hole
    assert _united(tiling).volume() == pytest.approx(large.volume, rel=1e-9)


def test_union_of_the_tiles_less_pins_is_the_whole(large):
    tiling = make_tiles(large, TileParams(width_mm=120, height_mm=120, clearance_mm=0.3, number=False))
    pins = tiling.counts["pins"]
    radius, length, tip = 1.5, 4.5, 0.45

    def volume(r, full):  # a prism of 32 sides with a blunt tip
        area = 16.0 * np.sin(2.0 * np.pi / 32) * r**2
        s = (r - tip) / r
        return area * (full - tip + tip * (1.0 + s + s * s) / 3.0)

    pin = volume(radius, length)
    hole = volume((radius + 0.3) / np.cos(np.pi / 32), length + 0.3)
    total = sum(tile.solid.volume for tile in tiling.tiles)
    assert total - pins * pin + pins * hole == pytest.approx(large.volume, rel=1e-9)
    assert sum(tile.pins for tile in tiling.tiles) == sum(tile.holes for tile in tiling.tiles) == pins > 8


def test_neighbours_do_not_touch_but_at_the_joint(large):
    tiling = make_tiles(large, TileParams(width_mm=120, height_mm=120, clearance_mm=0.3))
    for first in tiling.tiles:
        for second in tiling.tiles[first.number :]:
            shared = first.solid.to_manifold() ^ second.solid.to_manifold()
            assert abs(shared.volume()) < 1e-9


def test_clearance_is_kept_all_around_a_pin():
    tiling = make_tiles(slab(200.0, 60.0, 8.0), TileParams(width_mm=110, height_mm=80, clearance_mm=0.25))
    left, right = (tile.solid for tile in tiling.tiles)
    pin = left.vertices[left.vertices[:, 0] > 0.01]
    assert np.ptp(pin[:, 0]) <= 6.0
    assert pin[:, 0].max() == pytest.approx(6.0)
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(right.vertices.astype(np.float32), right.faces.astype(np.uint32))
    distance = scene.compute_distance(pin.astype(np.float32)).numpy()
    assert distance.min() == pytest.approx(0.25, abs=0.01)


def test_numbers_are_engraved_in_the_back(large):
    tiling = make_tiles(large, TileParams(width_mm=170, height_mm=120))
    plain_tiling = make_tiles(large, TileParams(width_mm=170, height_mm=120, number=False))
    assert tiling.counts["unnumbered"] == 0
    for tile, blank in zip(tiling.tiles, plain_tiling.tiles, strict=True):
        missing = blank.solid.volume - tile.solid.volume
        assert 5.0 < missing < 60.0
        heights = np.unique(tile.solid.vertices[:, 2])
        assert heights[0] == -6.0
        assert heights[1] == pytest.approx(-5.6)


def _seen_from_behind(number):
    """The engraved picture as letters, seen from behind, with the side that is up on top."""
    carved = engraving(plate(60.0, 60.0), number, depth=0.4).slice(-3.8)
    x0, y0, x1, y1 = carved.bounds()
    height = (y1 - y0) / 13
    rows = []
    for i in range(13):
        y = y1 - (i + 0.5) * height
        row = ""
        for x in np.arange(x1 - height / 2, x0, -height):  # from behind, x points to the left
            pixel = manifold3d.CrossSection.square([0.1, 0.1], True).translate([x, y])
            row += "#" if (carved ^ pixel).area() > 0.005 else "."
        rows.append(row)
    return rows


def test_numbers_read_right_from_behind():
    rows = _seen_from_behind(7)
    assert set(rows[0]) == {"#"}  # the upper stroke
    assert rows[4].endswith("#")  # the stem on the right
    assert not rows[4].startswith("#")
    assert set(rows[-1]) == {"#"}  # the line below
    assert set(rows[-3]) == {"."} or rows[-3].count("#") <= 2
    two = _seen_from_behind(2)
    assert two[3].endswith("#")
    assert not two[3].startswith("#")
    assert two[7].startswith("#")
    assert not two[7].endswith("#")


def test_all_digits_differ():
    pictures = {"".join(_seen_from_behind(digit)) for digit in range(10)}
    assert len(pictures) == 10


def test_tiles_too_small_for_a_number_are_counted():
    tiling = make_tiles(slab(60.0, 10.0), TileParams(width_mm=9.5, height_mm=12))
    assert tiling.counts["unnumbered"] == tiling.counts["tiles"] > 6
    assert engraving(plate(4.0, 4.0), 12, depth=0.4) is None


def test_pins_keep_away_from_holes_in_the_plate():
    pocket = plain(manifold3d.Manifold.cube([10.0, 16.0, 3.0], True).translate([0.0, 30.0, -4.0]))
    solid = Solid.from_manifold(plate(200.0, 120.0) - pocket, colored=False)
    tiling = make_tiles(solid, TileParams(width_mm=110, height_mm=130, **EXACT))
    assert tiling.counts["pins"] >= 2
    left = tiling.tiles[0].solid.vertices
    beyond = left[left[:, 0] > 0.01]
    assert len(beyond) > 0
    assert not ((beyond[:, 1] > 21.0) & (beyond[:, 1] < 39.0)).any()
    assert sum(tile.solid.volume for tile in tiling.tiles) == pytest.approx(solid.volume, rel=1e-9)


def test_empty_tiles_are_left_out():
    corner = Solid.from_manifold(plate(200.0, 200.0).trim_by_plane([-1.0, -1.0, 0.0], 0.0), colored=False)
    tiling = make_tiles(corner, TileParams(width_mm=70, height_mm=70, **EXACT))
    assert tiling.counts["tiles"] == 6  # of nine
    assert [tile.number for tile in tiling.tiles] == [1, 4, 5, 7, 8, 9]
    assert sum(tile.solid.volume for tile in tiling.tiles) == pytest.approx(corner.volume, rel=1e-9)


def test_cuts_have_the_colour_of_the_plate():
    tiling = make_tiles(ball_on_slab(colored=True), TileParams(width_mm=40, height_mm=60))
    for tile in tiling.tiles:
        assert tile.solid.colors is not None
        corners = tile.solid.corner_colors()
        assert (corners[tile.solid.is_plate] == PLATE_COLOR).all()
        assert corners.min() > 0.0


def test_tiles_without_a_plate_have_pins_where_there_is_material():
    block = plain(manifold3d.Manifold.cube([100.0, 40.0, 12.0]).translate([-50.0, -20.0, 0.0]))
    tiling = make_tiles(Solid.from_manifold(block, colored=False), TileParams(width_mm=60, height_mm=60))
    assert tiling.pin_mm == 3.0
    assert tiling.counts["pins"] >= 1


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({"width_mm": 6, "height_mm": 60}, "width_mm must be at least .* for pins of 2 mm"),
        ({"width_mm": 60, "height_mm": 60, "pin_mm": 4}, "at least 5.6 mm thick for pins of 4 mm"),
        ({"width_mm": 9.5, "height_mm": 9.5, "pin_mm": 0.5}, "must be larger: .* more than 400"),
    ],
)
def test_tiles_that_cannot_be(values, sentence):
    with pytest.raises(ParameterError, match=sentence):
        make_tiles(slab(400.0, 200.0), TileParams(**values))


def test_pins_that_fit_nowhere_are_an_error():
    # A plate that is hollow where the pins would lie.
    hollow = plate(100.0, 40.0, 8.0) - plain(
        manifold3d.Manifold.cube([96.0, 36.0, 3.0], True).translate([0.0, 0.0, -4.0])
    )
    solid = Solid.from_manifold(hollow, colored=False)
    with pytest.raises(ParameterError, match="fit into none of the joints"):
        make_tiles(solid, TileParams(width_mm=60, height_mm=60))


def test_parts_without_hold_go_with_the_neighbour_that_holds_them():
    # A hook that starts on the left half, crosses the joint at x = 0 above the plate and ends in the air.
    post = plain(manifold3d.Manifold.cube([6.0, 6.0, 20.0]).translate([-10.0, -3.0, -2.0]))
    arm = plain(manifold3d.Manifold.cube([25.0, 6.0, 4.0]).translate([-10.0, -3.0, 14.0]))
    solid = Solid.from_manifold(plate(200.0, 60.0) + post + arm, colored=False)
    tiling = make_tiles(solid, TileParams(width_mm=130, height_mm=80, **EXACT))
    assert tiling.counts["loose"] == 0
    assert [len(tile.solid.to_manifold().decompose()) for tile in tiling.tiles] == [1, 1]
    np.testing.assert_allclose(tiling.tiles[0].solid.size, [115.0, 60.0, 22.0])
    np.testing.assert_allclose(tiling.tiles[1].solid.size, [100.0, 60.0, 4.0])
    assert sum(tile.solid.volume for tile in tiling.tiles) == pytest.approx(solid.volume, rel=1e-9)


def test_loose_parts_that_would_make_a_tile_too_large_are_counted():
    post = plain(manifold3d.Manifold.cube([6.0, 6.0, 20.0]).translate([-10.0, -3.0, -2.0]))
    arm = plain(manifold3d.Manifold.cube([25.0, 6.0, 4.0]).translate([-10.0, -3.0, 14.0]))
    solid = Solid.from_manifold(plate(200.0, 60.0) + post + arm, colored=False)
    tiling = make_tiles(solid, TileParams(width_mm=110, height_mm=80, **EXACT))
    assert tiling.counts["loose"] == 1
    assert (tiling.tiles[0].solid.size[:2] <= [110.0, 80.0]).all()
    assert sum(tile.solid.volume for tile in tiling.tiles) == pytest.approx(solid.volume, rel=1e-9)


def test_parts_go_only_to_a_tile_that_has_room_for_them():
    # An arm that starts on the left tile and passes over the one in the middle to the one on the right.
    post = plain(manifold3d.Manifold.cube([6.0, 6.0, 20.0]).translate([-40.0, -3.0, -2.0]))
    arm = plain(manifold3d.Manifold.cube([80.0, 6.0, 4.0]).translate([-40.0, -3.0, 14.0]))
    solid = Solid.from_manifold(plate(180.0, 60.0) + post + arm, colored=False)
    tiling = make_tiles(solid, TileParams(width_mm=78, height_mm=80, **EXACT))
    assert tiling.counts["columns"] == 3
    assert tiling.counts["loose"] == 2  # 60 mm for each tile: with 60 or 10 mm of arm they are too wide
    whole, _ = held({(0, 0): solid.to_manifold()}, -4.0, (200.0, 200.0))
    assert whole[0, 0].volume() == pytest.approx(solid.volume)
    # Three tiles with room enough: the last piece hangs on the one in the middle.
    cuts = [(-90.0, -30.0), (-30.0, 30.0), (30.0, 90.0)]
    bodies = {
        (i, 0): solid.to_manifold() ^ plain(manifold3d.Manifold.cube([60, 60, 40]).translate([x, -30, -10]))
        for i, (x, _) in enumerate(cuts)
    }
    given, loose = held(bodies, -4.0, (200.0, 80.0))
    assert loose == 0
    assert [len(body.decompose()) for body in given.values()] == [1, 1, 1]
    assert given[0, 0].bounding_box()[3] == 40.0
    assert sum(body.volume() for body in given.values()) == pytest.approx(solid.volume, rel=1e-9)
