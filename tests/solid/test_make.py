from types import SimpleNamespace

import manifold3d
import numpy as np
import pytest
import trimesh
from solid_bodies import arrays, ball, cut, ring, sheet, together, under

import o3d_relief as rel
from o3d_relief.errors import MeshError, ParameterError
from o3d_relief.plate_params import PlateParams
from o3d_relief.scene.arrays import MeshArrays
from o3d_relief.solid.bodies import _swept, joined
from o3d_relief.solid.body import PLATE_COLOR
from o3d_relief.solid.checks import check_solid
from o3d_relief.solid.make import solid_of
from shapes import bust, to_mesh


def _params(mesh, **values):
    """Ask for the width that leaves the mesh at its own size."""
    used = mesh.vertices[np.unique(mesh.faces)]
    extent = np.ptp(used, axis=0)
    values = {"margin_mm": 6.0, "base_mm": 4.0, **values}
    return PlateParams(width_mm=float(extent[0]) + 2.0 * values["margin_mm"], **values)


def _made(mesh, **values):
    params = _params(mesh, **values)
    solid = solid_of(mesh, params)
    seen = trimesh.Trimesh(solid.vertices, solid.faces, process=False)
    assert seen.is_watertight
    assert seen.is_winding_consistent
    assert seen.volume > 0.0
    assert solid.size[0] == pytest.approx(params.width_mm, abs=1e-9)
    if params.depth_mm is not None:
        assert solid.size[2] == pytest.approx(params.depth_mm, abs=1e-9)
    report = check_solid(solid, params)
    assert report.failures == ()
    assert report.overlap_share < 1e-4
    return solid, report


def _plate_volume(mesh, params=None):
    x, y, _ = np.ptp(mesh.vertices[np.unique(mesh.faces)], axis=0)
    return (x + 12.0) * (y + 12.0) * 4.0


def test_half_a_ball_on_a_plate():
    mesh = cut(ball())
    solid, report = _made(mesh)
    assert solid.volume == pytest.approx(_plate_volume(mesh) + under(mesh), rel=1e-9)
    assert under(mesh) == pytest.approx(2 / 3 * np.pi * 30**3, rel=0.02)
    assert report.bodies == 1
    assert report.back_deviation_mm == 0.0
    assert solid.counts["parts_closed"] == 1
    assert report.verdict == "pass"


def test_without_a_plate_the_back_is_the_relief_plane():
    mesh = cut(ball())
    solid, _ = _made(mesh, shape="none", margin_mm=0.0)
    assert solid.volume == pytest.approx(under(mesh), rel=1e-9)
    assert solid.vertices[:, 2].min() == 0.0


def test_an_arch_stays_free():
    mesh = cut(ring())
    solid, report = _made(mesh)
    assert report.bodies == 1
    # One handle: there is air behind the arch.
    assert trimesh.Trimesh(solid.vertices, solid.faces, process=False).euler_number == 0
    assert solid.volume == pytest.approx(_plate_volume(mesh) + under(mesh), rel=1e-9)


def test_what_floats_is_reported_bridged_or_removed():
    loose = ring((0, 0, 30))
    mesh = cut(together(loose, ball((0, 0, -5), 10.0)))
    kept, report = _made(mesh)
    assert report.bodies == 2
    assert report.verdict == "warnings"
    assert "1 parts touch nothing" in report.warnings[0]
    assert kept.counts["loose_mm3"] == pytest.approx(loose.volume, rel=1e-6)
    removed, report = _made(mesh, loose="remove")
    assert report.bodies == 1
    assert kept.volume - removed.volume == pytest.approx(loose.volume, rel=1e-6)
    bridged, report = _made(mesh, loose="bridge")
    assert report.bodies == 1
    assert bridged.counts["pins"] == 1
    assert bridged.volume > kept.volume


def _cube(side, place=(0, 0, 0)):
    return manifold3d.Manifold.cube([side] * 3, True).translate(place)


def test_what_a_union_leaves_is_swept():
    params, block = PlateParams(), _cube(20) - _cube(5)
    filled, counts = _swept(block + _cube(0.1, (30, 0, 0)), params)
    assert counts == {"voids_filled": 1.0, "crumbs": 1.0}
    assert filled.volume() == pytest.approx(8000.0)
    # The cube in the void would be lost with it.
    nested, counts = _swept((block - _cube(0.1, (8, 0, 0))) + _cube(2), params)
    assert counts == {"voids_filled": 1.0, "crumbs": 0.0}
    assert nested.volume() == pytest.approx(8000.0 - 125.0 + 8.0)
    clean = _cube(20)
    assert _swept(clean, params)[0] is clean


def test_a_part_that_touches_the_plate_with_a_flat_face_is_one_with_it():
    box = trimesh.creation.box(bounds=[[-10, -10, 0], [10, 10, 5]])
    mesh = arrays(box.vertices, box.faces)
    solid, report = _made(mesh)
    assert report.bodies == 1
    assert solid.volume == pytest.approx(_plate_volume(mesh) + 2000.0, rel=1e-9)


def test_overlapping_parts_are_united():
    first, second = ball((-8, 0, 0), 15.0), ball((8, 0, 0), 15.0)
    mesh = cut(together(first, second))
    solid, report = _made(mesh)
    separate = under(cut(first)) + under(cut(second))
    lens = np.pi * (4 * 15 + 16) * (2 * 15 - 16) ** 2 / 12 / 2  # half of it lies in front of S
    assert solid.volume == pytest.approx(_plate_volume(mesh) + separate - lens, rel=0.01)
    assert report.bodies == 1


@pytest.mark.parametrize("spoil", ["inside out", "half turned", "doubled", "split"])
def test_spoilt_meshes_give_the_same_solid(spoil):
    good = cut(ball())
    vertices, faces = good.vertices, good.faces.copy()
    if spoil == "inside out":
        faces = faces[:, ::-1]
    elif spoil == "half turned":
        half = np.random.default_rng(0).random(len(faces)) < 0.5
        faces[half] = faces[half][:, ::-1]
    elif spoil == "doubled":
        faces = np.concatenate([faces, faces[:, ::-1]])
    else:  # every triangle on its own vertices
        vertices, faces = vertices[faces].reshape(-1, 3), np.arange(3 * len(faces)).reshape(-1, 3)
    solid, _ = _made(arrays(vertices, faces))
    assert solid.volume == pytest.approx(_plate_volume(good) + under(good), rel=1e-9)


def test_a_half_ball_that_is_open_at_its_back_is_capped():
    mesh = cut(ball(radius=20.0))
    lifted = arrays(mesh.vertices + np.array([0, 0, 10]), mesh.faces)
    solid, report = _made(lifted)
    assert solid.counts["parts_capped"] == 1
    assert report.bodies == 2
    assert solid.volume == pytest.approx(_plate_volume(mesh) + under(mesh), rel=1e-9)


def test_a_bowl_that_is_open_to_the_viewer_keeps_its_hollow():
    mesh = cut(ball(radius=20.0))
    bowl = arrays(mesh.vertices * [1, 1, -1] + [0, 0, 30], mesh.faces)  # mirrored: the inside is its front
    solid, report = _made(bowl)
    assert solid.counts["parts_to_the_plate"] == 1
    assert report.bodies == 1
    assert solid.volume == pytest.approx(_plate_volume(mesh) + under(bowl), rel=1e-9)


def test_a_vase_that_is_open_to_the_viewer_gets_thickness():
    mesh = cut(ball((0, 0, 8), 20.0))
    vase = arrays(mesh.vertices * [1, 1, -1] + [0, 0, 40], mesh.faces)  # the inside is its front
    solid, report = _made(vase, thickness_mm=2.0)
    assert solid.counts["parts_thickened"] == 1
    # The wall lies outside of what is seen; 44 wide with it, it is scaled to the 40 that were asked for.
    wall = 4 / 3 * np.pi * (22**3 - 20**3) * (1 + 8 / 20) / 2 * (40 / 44) ** 2
    assert solid.volume - solid.size[0] * solid.size[1] * 4.0 == pytest.approx(wall, rel=0.03)
    assert report.bodies == 2
    middle = solid.vertices[np.hypot(*solid.vertices[:, :2].T) < 3.0, 2]
    assert (np.abs(middle - 12.0) < 0.5).any()  # the bottom of the hollow
    assert (np.abs(middle - 10.0) < 0.5).any()  # and what is behind it
    assert middle.max() < 13.0


def test_a_height_field_is_closed_towards_the_plate():
    mesh = arrays(*sheet(lambda x, y: 10 + np.sin(x / 5) + y / 20))
    solid, report = _made(mesh)
    assert solid.counts["parts_to_the_plate"] == 1
    assert report.bodies == 1
    assert solid.volume == pytest.approx(_plate_volume(mesh) + under(mesh), rel=1e-9)


@pytest.mark.parametrize("sides", [1, 2])
def test_a_sheet_that_stands_on_the_plate_gets_thickness(sides):
    vertices, faces = sheet(lambda x, y: 0 * x)
    wall = np.stack([vertices[:, 0], vertices[:, 0] / 8, vertices[:, 1] + 20.0], axis=1)
    if sides == 2:
        faces = np.concatenate([faces, faces[:, ::-1]])
    solid, report = _made(arrays(wall, faces), thickness_mm=1.5)
    assert report.bodies == 1
    area = 40 * 40 * np.sqrt(1 + 1 / 64)
    assert solid.volume - solid.size[0] * solid.size[1] * 4.0 == pytest.approx(1.5 * area, rel=0.02)
    assert report.thinnest_mm == pytest.approx(1.5, abs=0.05)


def test_boxes_that_share_an_edge():
    corners = trimesh.creation.box(bounds=[[0, 0, 2], [10, 10, 12]])
    other = trimesh.creation.box(bounds=[[10, 10, 2], [20, 20, 12]])
    solid, _ = _made(cut(together(corners, other)))
    assert solid.volume == pytest.approx(32 * 32 * 4 + 2000.0, rel=1e-9)


@pytest.mark.parametrize("shape", ["rectangle", "ellipse", "contour", "none"])
def test_sizes_are_those_asked_for(shape):
    mesh = cut(together(ball((-20, 3, 0), 15.0), ring((15, 0, 0))))
    params = PlateParams(width_mm=120, depth_mm=17, shape=shape, frame_mm=2.0, frame_height_mm=3.0)
    solid = solid_of(mesh, params)
    assert solid.size[[0, 2]] == pytest.approx([120, 17], abs=1e-9)
    assert solid.vertices[:, 2].max() == pytest.approx(17 - params.back_mm)
    report = check_solid(solid, params)
    assert report.failures == ()
    assert report.bodies == 1


def test_a_contour_joins_what_is_far_apart():
    mesh = cut(together(ball((-40, 0, 0), 10.0), ball((40, 0, 0), 10.0)))
    solid, report = _made(mesh, shape="contour", margin_mm=2.0)
    assert report.bodies == 1
    assert solid.size[1] == pytest.approx(24.0, abs=0.1)


def test_a_frame_stands_around():
    mesh = cut(ball())
    plain, _ = _made(mesh)
    framed = solid_of(mesh, PlateParams(width_mm=float(np.ptp(mesh.vertices[:, 0])) + 22, frame_mm=5))
    edge = framed.vertices[np.abs(framed.vertices[:, 0]) > framed.size[0] / 2 - 1e-9]
    assert edge[:, 2].max() == pytest.approx(5.0)
    assert framed.size[0] == pytest.approx(plain.size[0] + 10.0)


def test_bodies_without_volume_are_no_solid():
    with pytest.raises(MeshError, match="Nothing of the relief has a volume"):
        joined(manifold3d.Manifold(), PlateParams(shape="none"))


@pytest.mark.parametrize(("hanging", "base"), [("keyhole", 5.0), ("magnets", 4.0)])
def test_pockets_in_the_back(hanging, base):
    mesh = cut(ball())
    params = _params(mesh, base_mm=base, hanging=hanging)
    solid = solid_of(mesh, params)
    plain = solid_of(mesh, _params(mesh, base_mm=base))
    report = check_solid(solid, params)
    assert report.verdict == "pass"
    assert report.back_deviation_mm == 0.0
    lost = plain.volume - solid.volume
    if hanging == "magnets":
        assert lost == pytest.approx(4 * np.pi * 5.1**2 * 2.2, rel=1e-3)
    else:
        entrance = np.pi * 4.25**2 * 3.8
        assert entrance < lost < 3 * entrance


def test_too_small_to_hang():
    mesh = cut(ball(radius=3.0))
    with pytest.raises(ParameterError, match="too small for hanging='magnets'"):
        solid_of(mesh, _params(mesh, margin_mm=2.0, hanging="magnets"))
    with pytest.raises(ParameterError, match="too small for hanging='keyhole'"):
        solid_of(mesh, _params(mesh, margin_mm=4.0, base_mm=5.0, hanging="keyhole"))


def test_colours_end_at_the_foot():
    mesh = cut(ball())
    red = np.tile([1.0, 0.0, 0.0], (len(mesh.vertices), 1))
    solid, _ = _made(MeshArrays(vertices=mesh.vertices, faces=mesh.faces, colors=red))
    above = solid.vertices[solid.faces][:, :, 2].max(axis=1) > 1e-9
    assert (solid.corner_colors()[above] == [1, 0, 0]).all()
    assert (solid.corner_colors()[~above] == PLATE_COLOR).all()
    shown = solid.to_open3d()
    assert len(shown.vertices) > len(solid.vertices)  # the seam is there twice


def test_textures_colour_the_vertices():
    vertices, faces = sheet(lambda x, y: 5 + 0 * x, count=3)
    texture = np.zeros((2, 2, 3), dtype=np.uint8)
    texture[:, 1, 2] = 255  # the right half is blue
    uvs = (vertices[faces, :2] / 40 + 0.5).reshape(-1, 2) * 0.98 + 0.01
    mesh = MeshArrays(
        vertices=vertices, faces=faces, triangle_uvs=uvs, textures=(texture,),
        material_ids=np.zeros(len(faces), dtype=np.int64),
    )  # fmt: skip
    solid, _ = _made(mesh)
    corner = solid.colors[np.argmax(solid.vertices[:, 2] + solid.vertices[:, 0] / 1e3)]
    assert corner.tolist() == [0, 0, 1]


def test_nothing_to_make_a_solid_of():
    with pytest.raises(MeshError, match="no width or no depth"):
        solid_of(arrays([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]], [[0, 1, 2]]), PlateParams())
    with pytest.raises(ParameterError, match="must be a PlateParams"):
        rel.make_solid(None, 150)
    with pytest.raises(ParameterError, match="must be a Relief, as make_relief returns"):
        rel.make_solid(SimpleNamespace(mesh=to_mesh(bust(8)), stages={}))


def test_a_relief_becomes_a_solid():
    relief = rel.make_relief(to_mesh(bust(30)), rel.ReliefParams(k=8, alpha=0.8))
    before = np.array(relief.mesh.vertices)
    params = PlateParams(width_mm=100, shape="contour")
    solid = rel.make_solid(relief, params)
    assert np.array_equal(before, np.asarray(relief.mesh.vertices))
    report = rel.check_solid(solid, params)
    assert report.failures == ()
    assert solid.counts["depth_ratio"] == 1.0
    again = rel.make_solid(relief, params)
    assert np.array_equal(again.vertices, solid.vertices)
    assert np.array_equal(again.faces, solid.faces)


def test_thin_walls_are_made_thicker_at_their_back():
    # A board that stands on two feet in front of the plate, 0.3 thick.
    board = trimesh.creation.box(bounds=[[-20, -15, 10], [20, 15, 10.3]])
    feet = [trimesh.creation.box(bounds=[[x - 2, -5, -3], [x + 2, 5, 10.1]]) for x in (-15, 15)]
    mesh = cut(together(board, *feet))
    thin, report = _made(mesh)
    assert report.thin_area_mm2 == pytest.approx(2 * 40 * 30 - 2 * 2 * 4 * 10, rel=0.01)
    thick, report = _made(mesh, thicken=True)
    assert report.thin_area_mm2 < 1.0
    assert report.bodies == 1
    assert thick.volume - thin.volume == pytest.approx((0.8 * 1.02 - 0.3) * (40 * 30 - 2 * 4 * 10), rel=0.02)
    assert thick.size == pytest.approx(thin.size)
    board_front = thick.vertices[:, 2] == thick.vertices[:, 2].max()
    assert np.ptp(thick.vertices[board_front, 0]) == pytest.approx(40.0)


def test_the_depth_holds_where_the_highest_part_is_removed():
    mesh = cut(together(ball((0, 0, -5), 10.0), ring((0, 0, 30))))
    params = _params(mesh, depth_mm=20, loose="remove")
    solid = solid_of(mesh, params)
    assert solid.counts["loose_bodies"] == 1
    assert solid.size[2] == pytest.approx(20.0, abs=1e-9)
    assert check_solid(solid, params).failures == ()


def test_pins_do_not_show():
    plate = trimesh.creation.box(bounds=[[-10, -10, 20], [10, 10, 20.2]])  # thinner than the pin is wide
    mesh = cut(together(plate, ball((0, 0, -5), 10.0)))
    solid, report = _made(mesh, loose="bridge")
    assert solid.counts["pins"] == 1
    assert report.bodies == 1
    assert solid.vertices[:, 2].max() == pytest.approx(20.2)


def test_boxes_that_share_an_edge_and_overlap_others():
    boxes = [([0, 0, 2], [10, 10, 12]), ([10, 10, 2], [20, 20, 12]), ([5, 5, 4], [15, 15, 14])]
    solid, _ = _made(cut(together(*[trimesh.creation.box(bounds=bounds) for bounds in boxes])))
    assert solid.volume == pytest.approx(32 * 32 * 4 + 3000 - 2 * 5 * 5 * 8, rel=1e-9)
