"""Pictures checked where they can be known: by symmetry, by a shadow's place, by a colour at a pixel."""

from __future__ import annotations

import numpy as np
import open3d as o3d
import pytest
from PIL import Image

from o3d_relief.errors import FileError, MeshError, ParameterError
from o3d_relief.show.annotate import tick_texts
from o3d_relief.show.camera import fit_camera, view_axes, view_direction
from o3d_relief.show.colors import COLORMAPS, apply_colormap, label_colors, to_linear, to_srgb
from o3d_relief.show.light import sky_directions, tile_index
from o3d_relief.show.render import plate_bounds, render, save_png
from o3d_relief.show.surface import read_surface

SQUARE = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
FRONT_LIGHT = (0.0, 0.0, 1.0)


def make_mesh(vertices, faces):
    return o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector(np.array(vertices, dtype=np.float64)),
        o3d.utility.Vector3iVector(np.array(faces, dtype=np.int32)),
    )


def make_square():
    return make_mesh(SQUARE, [(0, 1, 2), (0, 2, 3)])


def make_grid(n):
    """Return a square from -1 to 1 with n x n vertices."""
    x, y = np.meshgrid(np.linspace(-1, 1, n), np.linspace(-1, 1, n))
    index = np.arange(n * n).reshape(n, n)
    a, b, c, d = (part.ravel() for part in (index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]))
    faces = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    return make_mesh(np.column_stack([x.ravel(), y.ravel(), 0 * x.ravel()]), faces)


def brightness(image):
    return image.astype(np.float64).mean(axis=2)


def blurred(image, width=5):
    kernel = np.ones(width) / width
    rows = np.apply_along_axis(np.convolve, 0, brightness(image), kernel, mode="same")
    return np.apply_along_axis(np.convolve, 1, rows, kernel, mode="same")


# --- light ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("light", [(-0.5, 0.5, 0.7), (0.6, 0.2, 0.7), (0.1, -0.6, 0.7)])
def test_a_sphere_is_brightest_towards_the_lamp(light):
    sphere = o3d.geometry.TriangleMesh.create_sphere(1.0, 30)
    image = render(sphere, size=(100, 100), light=light, background=(0, 0, 0), ambient_occlusion=False)
    row, column = np.unravel_index(np.argmax(blurred(image)), (100, 100))
    found = np.array([column + 0.5 - 50, 50 - row - 0.5]) / 46.0
    expected = np.array(light[:2]) / np.linalg.norm(light)
    # The sky comes from above and from the camera, which pulls the brightest place a little.
    np.testing.assert_allclose(found, expected, atol=0.17)


def test_a_smooth_sphere_shows_no_facets():
    sphere = o3d.geometry.TriangleMesh.create_sphere(1.0, 14)
    flat = brightness(render(sphere, size=(120, 120), crease=0.0))[40:80, 30:60]
    smooth = brightness(render(sphere, size=(120, 120)))[40:80, 30:60]
    roughness = [np.abs(np.diff(part, n=2, axis=1)).max() for part in (flat, smooth)]
    assert roughness[1] < 0.35 * roughness[0]


def test_a_blocker_casts_a_shadow_on_the_plate_where_geometry_says():
    # A square of side 2 at height 3, lit from the upper left at 45 degrees: the shadow moves by (3, -3).
    blocker = make_mesh(np.add(SQUARE, (0, 0, 3.0)), [(0, 1, 2), (0, 2, 3)])
    frame = [(-6, -6, 0), (6, 6, 3)]
    options = {
        "size": (120, 120),
        "light": (-1, 1, 1),
        "plate": True,
        "bounds": frame,
        "ambient_occlusion": False,
    }
    lit = brightness(render(blocker, **options, shadows=False))
    shaded = brightness(render(blocker, **options))
    camera = fit_camera(
        [
            np.min([frame[0], plate_bounds(frame)[0]], axis=0),
            np.max([frame[1], plate_bounds(frame)[1]], axis=0),
        ],
        direction=(0, 0, 1),
        up=(0, 1, 0),
        area=(0, 0, 120, 120),
    )
    darker = lit - shaded > 40
    rows, columns = np.nonzero(darker)
    corners = camera.project([(2, -2, 0), (4, -4, 0)])
    assert abs(columns.min() - corners[0, 0]) < 2.5
    assert abs(columns.max() - corners[1, 0]) < 2.5
    assert abs(rows.min() - corners[0, 1]) < 2.5
    assert abs(rows.max() - corners[1, 1]) < 2.5
    assert np.array_equal(lit[:30], shaded[:30])  # nothing changes where no shadow falls


def test_the_shadow_is_soft_at_its_rim():
    blocker = make_mesh(np.add(SQUARE, (0, 0, 3.0)), [(0, 1, 2), (0, 2, 3)])
    image = brightness(
        render(
            blocker,
            size=(240, 240),
            light=(-1, 0, 1),
            plate=True,
            bounds=[(-6, -6, 0), (6, 6, 3)],
            ambient_occlusion=False,
        )
    )
    profile = image[120, 150:240]
    dark, bright = profile.min(), profile[-30]
    between = np.sum((profile > dark + 5) & (profile < bright - 5))
    assert between >= 4


def test_ambient_occlusion_darkens_a_concave_corner():
    # A floor and a wall that meet at y = 0, seen at 45 degrees.
    corner = make_mesh(
        [(-1, 0, 0), (1, 0, 0), (1, 0, 1), (-1, 0, 1), (1, 1, 0), (-1, 1, 0)],
        [(0, 3, 2), (0, 2, 1), (0, 1, 4), (0, 4, 5)],
    )
    options = {"direction": (0, 1, 1), "size": (80, 80), "shadows": False, "light": (0, -1, -1)}
    without = brightness(render(corner, **options, ambient_occlusion=False))
    with_it = brightness(render(corner, **options))
    edge = int(np.argmin(with_it[10:70, 40])) + 10
    assert without[edge, 40] - with_it[edge, 40] > 15
    assert with_it[edge, 40] < with_it[edge - 15, 40] - 8
    assert with_it[edge, 40] < with_it[edge + 15, 40] - 8


def test_ambient_occlusion_leaves_a_convex_body_alone():
    sphere = o3d.geometry.TriangleMesh.create_sphere(1.0, 30)
    pictures = [render(sphere, size=(60, 60), shadows=False, ambient_occlusion=on) for on in (True, False)]
    assert np.abs(pictures[0].astype(int) - pictures[1]).max() <= 2


def test_a_niche_that_is_open_to_the_camera_is_not_taken_for_inside_out():
    box = o3d.geometry.TriangleMesh.create_box(1, 1, 1)
    faces = np.asarray(box.triangles)[:, [0, 2, 1]]
    height = np.asarray(box.vertices)[faces][:, :, 2].min(axis=1)
    niche = make_mesh(np.asarray(box.vertices), faces[height < 0.5])  # without the side towards z+
    options = {"size": (40, 40), "light": FRONT_LIGHT, "ambient_occlusion": False}
    flat = brightness(render(make_square(), **options))[20, 20]
    assert brightness(render(niche, **options))[20, 20] == pytest.approx(flat, abs=1)


def test_the_inside_of_an_open_mesh_is_darker_but_not_black():
    outside = brightness(render(make_square(), size=(40, 40), light=FRONT_LIGHT))[20, 20]
    turned = make_mesh(SQUARE, [(0, 2, 1), (0, 3, 2)])
    inside = brightness(render(turned, size=(40, 40), light=FRONT_LIGHT))[20, 20]
    assert 40 < inside < 0.8 * outside


def test_a_body_that_is_inside_out_looks_like_one_that_is_not():
    sphere = o3d.geometry.TriangleMesh.create_sphere(1.0, 20)
    turned = make_mesh(np.asarray(sphere.vertices), np.asarray(sphere.triangles)[:, [0, 2, 1]])
    difference = render(sphere, size=(50, 50)).astype(int) - render(turned, size=(50, 50))
    assert np.abs(difference).max() <= 2


def test_faces_that_are_there_once_for_each_side_are_equally_bright():
    doubled = make_mesh(SQUARE, [(0, 1, 2), (0, 2, 3), (0, 2, 1), (0, 3, 2)])
    for direction in ((0, 0, 1), (0, 0, -1)):
        one = render(make_square(), size=(40, 40), light=FRONT_LIGHT)
        two = render(doubled, size=(40, 40), direction=direction, light=direction)
        assert np.abs(one.astype(int) - two).max() <= 1


def test_the_light_stays_with_the_mesh_when_the_camera_turns():
    # The left and right faces of a box: the left one faces the lamp from wherever it is seen.
    box = o3d.geometry.TriangleMesh.create_box(1, 1, 1)
    left = brightness(render(box, size=(60, 60), direction=view_direction(-60)))
    right = brightness(render(box, size=(60, 60), direction=view_direction(60)))
    assert left[30, 20] > right[30, 40] + 40


# --- colours -------------------------------------------------------------------------------------


def test_vertex_colors_are_drawn():
    square = make_square()
    square.vertex_colors = o3d.utility.Vector3dVector([(1, 0, 0), (0, 0, 1), (0, 0, 1), (1, 0, 0)])
    image = render(square, size=(60, 60), light=FRONT_LIGHT)
    assert image[30, 5, 0] > 200
    assert image[30, 5, 2] < 90
    assert image[30, 54, 2] > 200
    assert image[30, 54, 0] < 90


def test_colors_override_the_mesh():
    square = make_square()
    square.paint_uniform_color((1, 0, 0))
    image = render(square, size=(20, 20), colors=np.tile((0.0, 1.0, 0.0), (4, 1)), light=FRONT_LIGHT)
    assert image[10, 10, 1] > 200
    assert image[10, 10, 0] == 0


def test_sharp_colors_do_not_blend():
    colors = np.array([(1, 0, 0), (0, 0, 1), (0, 0, 1), (1, 0, 0)], dtype=float)
    soft = render(make_square(), size=(60, 60), colors=colors, supersampling=1)[30, 5:55].astype(int)
    sharp = render(make_square(), size=(60, 60), colors=colors, sharp_colors=True, supersampling=1)[30, 5:55]
    assert np.sum((soft[:, 0] > 20) & (soft[:, 2] > 20)) > 20
    assert np.sum((sharp[:, 0] > 20) & (sharp[:, 2] > 20)) == 0


def make_textured():
    square = make_square()
    # Rows run along v: the first row lies at v = 0, as in textures that Open3D has read.
    texture = np.array([[(255, 0, 0), (0, 255, 0)], [(0, 0, 255), (255, 255, 255)]], dtype=np.uint8)
    square.textures = [o3d.geometry.Image(np.ascontiguousarray(texture.repeat(8, 0).repeat(8, 1)))]
    square.triangle_uvs = o3d.utility.Vector2dVector([(0, 0), (1, 0), (1, 1), (0, 0), (1, 1), (0, 1)])
    square.triangle_material_ids = o3d.utility.IntVector([0, 0])
    return square


def test_a_texture_lies_the_right_way_round():
    image = render(make_textured(), size=(80, 80), light=FRONT_LIGHT)
    lower_left, lower_right, upper_left, upper_right = (
        image[60, 20],
        image[60, 60],
        image[20, 20],
        image[20, 60],
    )
    assert (lower_left > 150).tolist() == [True, False, False]
    assert (lower_right > 150).tolist() == [False, True, False]
    assert (upper_left > 150).tolist() == [False, False, True]
    assert (upper_right > 150).all()


def test_a_texture_lies_as_open3d_reads_it_from_a_file(tmp_path):
    picture = np.zeros((8, 8, 3), dtype=np.uint8)
    picture[:4] = (255, 0, 0)  # the upper half of the picture is red
    picture[4:] = (0, 0, 255)
    Image.fromarray(picture).save(tmp_path / "picture.png")
    (tmp_path / "square.mtl").write_text("newmtl paint\nmap_Kd picture.png\n")
    corners = "".join(f"v {x} {y} 0\n" for x, y, _ in SQUARE)
    uvs = "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
    faces = "usemtl paint\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n"
    (tmp_path / "square.obj").write_text(f"mtllib square.mtl\n{corners}{uvs}{faces}")
    image = render(o3d.io.read_triangle_mesh(str(tmp_path / "square.obj")), size=(40, 40), light=FRONT_LIGHT)
    assert (image[10, 20] > 150).tolist() == [True, False, False]
    assert (image[30, 20] > 150).tolist() == [False, False, True]


def test_texture_times_vertex_color():
    square = make_textured()
    square.paint_uniform_color((1, 0, 0))
    image = render(square, size=(80, 80), light=FRONT_LIGHT)
    assert (image[20, 60] > 150).tolist() == [True, False, False]  # white times red
    assert image[60, 60].max() < 20  # green times red


def test_faces_without_a_texture_stay_as_they_are():
    square = make_textured()
    square.triangle_material_ids = o3d.utility.IntVector([7, -1])
    image = render(square, size=(40, 40), light=FRONT_LIGHT)
    assert (image[5:35, 5:35].min(axis=2) > 150).all()


@pytest.mark.parametrize("name", list(COLORMAPS))
def test_a_field_maps_its_ends_to_the_ends_of_the_color_map(name):
    field = np.array([-2.0, 5.0, 5.0, -2.0])
    options = {"size": (200, 100), "scale": 40.0, "light": FRONT_LIGHT, "sharp_colors": True}
    image = render(make_square(), field=field, colormap=name, **options)
    for color, column in ((COLORMAPS[name][0], 50), (COLORMAPS[name][-1], 100)):
        painted = render(make_square(), colors=np.tile(color, (4, 1)), **options)
        np.testing.assert_allclose(image[50, column].astype(int), painted[50, 100].astype(int), atol=1)


def test_the_color_bar_shows_the_color_map():
    image = render(make_square(), size=(300, 300), field=np.arange(4.0), field_label="height")
    bar = image[:, 240:].reshape(-1, 3).astype(int)
    for color in (COLORMAPS["viridis"][0], COLORMAPS["viridis"][-1]):
        assert np.any(np.abs(bar - np.rint(color * 255)).max(axis=1) <= 3)


def test_the_numbers_beside_a_bar_are_right():
    rng = np.random.default_rng(0)
    ends = [(0.0, 10.0**e) for e in range(-2, 5)] + [(0.0, 0.75), (-2.0, 2.0), (97.0, 98.0)]
    for low, width in rng.random((300, 2)) * [40.0, 1.0]:
        ends.append((low - 20.0, low - 20.0 + 10.0 ** (6.0 * width - 2.0)))
    for low, high in ends:
        texts = tick_texts(low, high)
        told = np.array([float(text) for text in texts])
        assert np.abs(told - np.linspace(low, high, 5)).max() <= 0.025 * (high - low)
        assert len({len(text.partition(".")[2]) for text in texts}) == 1
        assert "-0" not in [text.rstrip("0.") for text in texts]
    assert tick_texts(5.0, 5.0) == ["5.000"] * 5


def test_unknown_values_of_a_field_are_grey():
    field = np.full(4, np.nan)
    image = render(make_square(), size=(200, 200), field=field, light=FRONT_LIGHT)
    center = image[100, 80].astype(int)
    assert np.ptp(center) < 15


# --- camera and points ---------------------------------------------------------------------------


def test_points_land_on_their_pixels():
    red, green = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
    image = render(
        make_square(),
        size=(100, 100),
        points=[(0.5, 0.25, 0), (-0.5, -0.75, -9)],  # the second one lies behind the square
        point_colors=[red, green],
        point_radius=3,
        bounds=[(-1, -1, 0), (1, 1, 0)],
    )
    assert image[int(50 - 0.25 * 46), int(50 + 0.5 * 46)].tolist() == [255, 0, 0]
    assert image[int(50 + 0.75 * 46), int(50 - 0.5 * 46)].tolist() == [0, 255, 0]
    is_red = np.all(image == (255, 0, 0), axis=2)
    rows, columns = np.nonzero(is_red)
    assert abs(rows.mean() + 0.5 - (50 - 0.25 * 46)) < 0.6
    assert abs(columns.mean() + 0.5 - (50 + 0.5 * 46)) < 0.6
    assert 15 < is_red.sum() < 40  # about pi 3^2


def test_points_that_are_not_finite_or_outside_are_left_out():
    plain = render(make_square(), size=(40, 40), supersampling=1)
    points = [(np.nan, 0, 0), (50, 0, 0), (0, np.inf, 0)]
    assert np.array_equal(plain, render(make_square(), size=(40, 40), points=points, supersampling=1))


def test_point_field_takes_its_colors_from_the_map():
    image = render(
        make_square(),
        size=(200, 200),
        points=[(-0.5, 0, 0), (0.5, 0, 0)],
        point_field=[0.0, 2.0],
        point_radius=5,
    )
    for color in (COLORMAPS["viridis"][0], COLORMAPS["viridis"][-1]):
        expected = np.rint(color * 255).astype(int)
        assert np.sum(np.abs(image[:, :160].astype(int) - expected).max(axis=2) <= 1) > 40


def test_equal_bounds_give_equal_framing():
    bounds = [(-3, -3, -1), (3, 3, 1)]
    for direction in (view_direction(0), view_direction(50, 20)):
        small = make_square()
        large = make_square().scale(2.0, center=(0, 0, 0))
        covered = []
        for mesh in (small, large):
            image = render(mesh, direction=direction, bounds=bounds, size=(120, 120), background=(0, 0, 1))
            covered.append(np.nonzero(np.any(image != (0, 0, 255), axis=2)))
        for axis in range(2):
            extents = [np.ptp(indices[axis]) + 1 for indices in covered]
            assert extents[1] == pytest.approx(2 * extents[0], abs=3)
            middles = [0.5 * (indices[axis].min() + indices[axis].max()) for indices in covered]
            assert middles[0] == pytest.approx(middles[1], abs=1)


@pytest.mark.parametrize("move", [(1e4, -3e4, 2e4), (0.0, 0.0, 0.0)])
@pytest.mark.parametrize("factor", [1e-3, 1.0, 1e3])
def test_the_picture_does_not_depend_on_place_and_size(move, factor):
    mesh = o3d.geometry.TriangleMesh.create_torus(1.0, 0.4, 40, 20)
    expected = render(mesh, size=(60, 60), direction=view_direction(30, 30))
    moved = mesh.scale(factor, center=(0, 0, 0)).translate(np.array(move) * factor)
    image = render(moved, size=(60, 60), direction=view_direction(30, 30))
    assert np.mean(np.abs(image.astype(int) - expected) > 3) < 0.01


def test_view_direction_turns_about_y_then_up():
    np.testing.assert_allclose(view_direction(90, 0), (1, 0, 0), atol=1e-15)
    np.testing.assert_allclose(view_direction(0, 90), (0, 1, 0), atol=1e-15)
    np.testing.assert_allclose(view_direction(-30, 0), (-0.5, 0, np.sqrt(0.75)), atol=1e-15)


@pytest.mark.parametrize("direction", [(0, 0, 1), (0, 1, 0), (1, 2, 3), (0, -5, 0)])
def test_view_axes_are_orthonormal_and_right_handed(direction):
    axes = view_axes(direction, (0, 1, 0))
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(axes) == pytest.approx(1.0)


# --- the same input, the same bytes ---------------------------------------------------------------


def test_equal_input_gives_equal_bytes_on_any_number_of_threads_and_bands(monkeypatch):
    mesh = o3d.geometry.TriangleMesh.create_torus(1.0, 0.4, 40, 20)
    options = {"size": (120, 90), "plate": True, "direction": view_direction(40, 10)}
    first = render(mesh, **options)
    assert np.array_equal(first, render(mesh, **options))
    for cores, rows in ((1, 90), (3, 16), (8, 7)):
        bands = [(top, min(top + rows, 90)) for top in range(0, 90, rows)]
        monkeypatch.setattr("o3d_relief.show.darkroom._window", lambda *_: (0, 0, 120, 90))
        monkeypatch.setattr("o3d_relief.show.darkroom._bands", lambda *_, bands=bands: bands)
        monkeypatch.setattr("os.cpu_count", lambda cores=cores: cores)
        assert np.array_equal(first, render(mesh, **options))


def test_the_mesh_is_not_modified():
    square = make_square()
    render(square, size=(16, 16), plate=True)
    assert not square.has_vertex_normals()
    np.testing.assert_array_equal(np.asarray(square.vertices), np.array(SQUARE, dtype=float))


# --- normals -------------------------------------------------------------------------------------


def test_a_box_keeps_its_edges():
    surface = read_surface(o3d.geometry.TriangleMesh.create_box(1, 1, 1), 50.0)
    expected = np.repeat(surface.normals[:, None], 3, axis=1)
    np.testing.assert_allclose(surface.corner_normals, expected, atol=1e-6)


def test_a_sphere_gets_radial_normals_also_over_unwelded_seams():
    sphere = o3d.geometry.TriangleMesh.create_sphere(1.0, 40)
    faces = np.asarray(sphere.triangles)
    vertices = np.asarray(sphere.vertices)[faces.ravel()]
    soup = make_mesh(vertices, np.arange(len(vertices)).reshape(-1, 3))
    surface = read_surface(soup, 50.0)
    corners = surface.vertices[surface.faces]
    # Not at the poles: their thin fans of triangles lie a little askew on one side.
    cosine = np.einsum("fcj,fcj->fc", surface.corner_normals, corners)
    assert cosine.min() > np.cos(np.deg2rad(3.0))


def test_flat_shading_takes_the_face_normals():
    surface = read_surface(o3d.geometry.TriangleMesh.create_sphere(1.0, 5), 0.0)
    np.testing.assert_array_equal(surface.corner_normals, np.repeat(surface.normals[:, None], 3, axis=1))


def test_a_fan_of_very_many_faces_is_drawn():
    angles = np.linspace(0.0, 2.0 * np.pi, 5000, endpoint=False)
    rim = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(5000)])
    around = np.arange(5000)
    faces = np.column_stack([np.full(5000, 5000), around, np.roll(around, -1)])
    image = brightness(render(make_mesh([*rim, (0, 0, 2.0)], faces), size=(60, 60)))
    assert image[20, 20] > image[40, 40] + 40  # a cone: bright towards the lamp, dark on the other side


# --- what is wrong is said ------------------------------------------------------------------------


def test_degenerate_triangles_and_unused_vertices_do_no_harm():
    vertices = [*SQUARE, (5, 5, 5), (0, 0, 0)]
    mesh = make_mesh(vertices, [(0, 1, 2), (0, 2, 3), (0, 0, 1), (0, 5, 2), (1, 1, 1)])
    assert np.array_equal(render(mesh, size=(40, 40)), render(make_square(), size=(40, 40)))


@pytest.mark.parametrize(
    ("vertices", "faces", "message"),
    [
        ([], [], "no triangles"),
        (SQUARE, [], "no triangles"),
        (SQUARE, [(0, 0, 1)], "no triangle with an area"),
        (SQUARE, [(0, 1, 4)], "out of range"),
        (SQUARE, [(0, 1, -1)], "out of range"),
        ([*SQUARE[:3], (np.nan, 0, 0)], [(0, 1, 2), (0, 2, 3)], "not finite"),
    ],
)
def test_a_mesh_that_cannot_be_drawn_raises(vertices, faces, message):
    mesh = make_mesh(np.array(vertices).reshape(-1, 3), np.array(faces).reshape(-1, 3))
    with pytest.raises(MeshError, match=message):
        render(mesh, size=(16, 16))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"size": (0, 10)}, "size"),
        ({"size": 16}, "size must be two whole numbers"),
        ({"size": "64"}, r"size must be two whole numbers\. Got '64' instead"),
        ({"size": np.array(5)}, r"size must be two whole numbers\. Got array\(5\) instead"),
        ({"size": np.zeros((2, 3))}, "size must be a whole number"),
        ({"field": [10**400, 0, 0, 0]}, "field must be numbers"),
        ({"supersampling": 0}, "supersampling"),
        ({"direction": (0, 0, 0)}, "direction"),
        ({"light": (np.nan, 0, 0)}, "light"),
        ({"up": (1, 2)}, "up"),
        ({"bounds": [(1, 1, 1), (0, 0, 0)]}, "bounds"),
        ({"colors": np.zeros((3, 3))}, "colors"),
        ({"field": np.zeros(3)}, "field"),
        ({"field": np.zeros(4), "colormap": "rainbow"}, "colormap"),
        ({"field": np.zeros(4), "colors": np.zeros((4, 3))}, "exclude each other"),
        ({"points": np.zeros(3)}, "points"),
        ({"points": np.zeros((2, 3)), "point_colors": np.zeros((5, 3))}, "point_colors"),
        ({"points": np.zeros((2, 3)), "point_field": np.zeros(5)}, "point_field"),
        ({"background": (1, 1)}, "background"),
        ({"background": "white"}, "background must be numbers"),
        ({"size": ("16", 16)}, "size must be a whole number between 1 and 20000"),
        ({"size": (True, 16)}, "size must be a whole number"),
        ({"supersampling": 1.5}, "supersampling must be a whole number between 1 and 8"),
        ({"direction": "front"}, "direction must be three finite numbers"),
        ({"crease": -1}, "crease must be at least 0"),
        ({"crease": np.nan}, "crease must be finite"),
        ({"scale": 0}, "scale must be greater than 0"),
        ({"scale": -3.0}, "scale must be greater than 0"),
        ({"scale": np.nan}, "scale must be finite"),
        ({"bounds": [0, 1]}, r"bounds must have the shape \(2, 3\)"),
        ({"bounds": "all", "plate": True}, "bounds must be numbers"),
        ({"colors": np.full((4, 3), np.nan)}, "colors must be finite"),
        ({"colors": np.full((4, 3), 1.5)}, r"colors must be finite, from 0 to 1\. Got 1\.5 instead"),
        ({"background": (255, 255, 255)}, r"background must be finite, from 0 to 1\. Got 255 instead"),
        ({"field": list("abcd")}, "field must be numbers"),
        ({"field": np.zeros(4), "field_range": (1.0, 0.0)}, "the lower one first"),
        ({"field": np.zeros(4), "field_range": (0.0, np.nan)}, "two finite numbers"),
        ({"field": np.zeros(4), "field_range": 3}, "field_range must have the shape"),
        ({"points": np.zeros((1, 3)), "point_radius": -1}, "point_radius must be at least 0"),
        ({"points": np.zeros((1, 3)), "point_colors": (0, 0, np.inf)}, "point_colors must be finite"),
    ],
)
def test_a_wrong_argument_raises(options, message):
    with pytest.raises(ParameterError, match=message):
        render(make_square(), **{"size": (16, 16), **options})


@pytest.mark.parametrize("stray", [(np.nan, 0, 0), (1e300, 0, 0), (50, 50, 50), (0, 0, np.inf)])
def test_vertices_that_no_face_uses_may_be_anything(stray):
    vertices, faces = [*SQUARE, stray], [(0, 1, 2), (0, 2, 3)]
    colors = np.full((5, 3), 0.5)
    plain = render(make_mesh(SQUARE, faces), size=(24, 24), colors=colors[:4])
    mesh = make_mesh(np.array(vertices), np.array(faces))
    for shade in (0.5, np.nan, 300.0):
        colors[4] = shade
        assert np.array_equal(render(mesh, size=(24, 24), colors=colors), plain)
    assert np.array_equal(mesh.vertices[4], stray, equal_nan=True)


def test_colors_may_be_beyond_one_by_rounding_errors():
    plain = render(make_square(), size=(24, 24), colors=np.ones((4, 3)))
    assert np.array_equal(render(make_square(), size=(24, 24), colors=np.full((4, 3), 1.0 + 1e-9)), plain)


def test_sizes_may_be_whole_numbers_of_numpy():
    plain = render(make_square(), size=(16, 12), supersampling=1)
    for size in (np.array([16, 12]), (np.int64(16), np.int32(12)), [16, 12]):
        assert np.array_equal(render(make_square(), size=size, supersampling=np.int64(1)), plain)


# --- files ---------------------------------------------------------------------------------------


def test_save_png_keeps_every_pixel(tmp_path):
    image = np.arange(4 * 5 * 3, dtype=np.uint8).reshape(4, 5, 3)
    save_png(tmp_path / "picture.png", image)
    with Image.open(tmp_path / "picture.png") as read:
        assert np.array_equal(np.asarray(read), image)
    assert [path.name for path in tmp_path.iterdir()] == ["picture.png"]


def test_save_png_into_a_missing_folder_raises_and_makes_nothing(tmp_path):
    with pytest.raises(FileError, match=r"folder .*nowhere.* is missing"):
        save_png(tmp_path / "nowhere" / "picture.png", np.zeros((2, 2, 3), dtype=np.uint8))
    assert list(tmp_path.iterdir()) == []


def test_save_png_leaves_nothing_behind_when_it_fails(tmp_path):
    target = tmp_path / "picture.png"
    target.mkdir()
    (target / "kept").write_text("kept")
    with pytest.raises(FileError, match="is a folder"):
        save_png(target, np.zeros((2, 2, 3), dtype=np.uint8))
    assert [path.name for path in tmp_path.iterdir()] == ["picture.png"]
    assert (target / "kept").read_text() == "kept"


def test_save_png_keeps_the_old_file_when_the_picture_is_bad(tmp_path):
    target = tmp_path / "picture.png"
    target.write_bytes(b"old")
    empty = [np.zeros(shape, dtype=np.uint8) for shape in ((0, 4, 3), (4, 0, 3))]
    for image in (np.zeros((2, 2, 7), dtype=np.uint8), np.zeros((2, 2, 3)), [[0]], *empty):
        with pytest.raises(ParameterError, match=r"image must be \(height, width, 3\) uint8"):
            save_png(target, image)
    assert [path.name for path in tmp_path.iterdir()] == ["picture.png"]
    assert target.read_bytes() == b"old"


# --- colours and patterns, by hand ---------------------------------------------------------------


def test_srgb_and_linear_light_are_inverse():
    values = np.linspace(0.0, 1.0, 256)
    np.testing.assert_allclose(to_srgb(to_linear(values)), values, atol=1e-6)
    assert float(to_linear(0.5)) == pytest.approx(0.21404114, abs=1e-6)


def test_color_maps_go_through_their_table():
    for name, table in COLORMAPS.items():
        np.testing.assert_allclose(apply_colormap(np.linspace(3, 5, len(table)), name), table, atol=1e-12)
    np.testing.assert_array_equal(apply_colormap([-9.0, 9.0], "heat", (0, 1)), COLORMAPS["heat"][[0, -1]])


def test_neighbouring_labels_differ():
    grid = make_grid(40)
    xy = np.asarray(grid.vertices)[:, :2]
    labels = (np.floor((xy[:, 0] + 1) * 4.99) + 10 * np.floor((xy[:, 1] + 1) * 4.99)).astype(np.int64)
    faces = np.asarray(grid.triangles).astype(np.int64)
    colors = label_colors(labels, faces)
    for a, b in ((0, 1), (1, 2), (2, 0)):
        first, second = labels[faces[:, a]], labels[faces[:, b]]
        touching = first != second
        assert np.all(np.any(colors[first[touching]] != colors[second[touching]], axis=1))


def test_a_tile_holds_every_number_once_and_neighbours_are_far_apart():
    rows, columns = np.mgrid[0:8, 0:8]
    tile = tile_index(rows, columns, 3)
    assert sorted(tile.ravel().tolist()) == list(range(64))
    assert sorted((tile[:2, :2] // 16).ravel().tolist()) == [0, 1, 2, 3]


def test_the_sky_is_evenly_covered():
    points, reach = sky_directions(128, 0.5)
    np.testing.assert_allclose(np.linalg.norm(points, axis=1), 1.0, atol=1e-6)
    assert np.linalg.norm(points.mean(axis=0)) < 0.01
    assert reach.min() >= 0.0
    assert reach.max() < 0.5


def test_colors_and_coordinates_that_are_no_numbers_do_not_matter():
    box = o3d.geometry.TriangleMesh.create_box()
    box.vertex_colors = o3d.utility.Vector3dVector(np.full((8, 3), np.nan))
    box.triangle_uvs = o3d.utility.Vector2dVector(np.full((36, 2), np.inf))
    box.textures = [o3d.geometry.Image(np.full((2, 2, 3), 255, np.uint8))]
    white = o3d.geometry.TriangleMesh.create_box()
    white.vertex_colors = o3d.utility.Vector3dVector(np.ones((8, 3)))
    assert np.array_equal(render(box, size=(32, 32)), render(white, size=(32, 32)))


@pytest.mark.parametrize("scale", [1e-60, 1e60])
def test_tiny_and_huge(scale):
    box = o3d.geometry.TriangleMesh.create_box()
    picture = render(box, size=(32, 32))
    assert np.abs(render(box.scale(scale, (0, 0, 0)), size=(32, 32)).astype(int) - picture).max() <= 8
