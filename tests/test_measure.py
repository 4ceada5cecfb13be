import sys

import numpy as np
import pytest

from o3d_relief import ReliefParams, View, make_relief
from o3d_relief.errors import MeshError, ParameterError, ReliefError
from o3d_relief.measure import SEVEN_VIEWS, ReliefQuality, Yardstick, measure_relief
from o3d_relief.scene.convert import arrays_mesh
from shapes import bust, exploded, grid, hills, joined, moved, sphere, to_mesh

FRONT = ((0.0, 0.0),)


def scaled(shape, factor):
    return shape[0] * np.array([1.0, 1.0, factor]), shape[1]


def half_sphere(side=181):
    """The upper half of a unit sphere over a disc, in rings and sectors."""
    tilt = np.linspace(0.0, np.pi / 2, side)[:, None]
    turn = np.linspace(0.0, 2 * np.pi, 2 * side + 1)[None, :]
    x, y, z = np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), np.cos(tilt) + 0 * turn
    number = np.arange(x.size).reshape(x.shape)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    faces = np.stack([np.stack([a, b, c], -1), np.stack([a, c, d], -1)]).reshape(-1, 3)
    return np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1), faces


def plates(*heights):
    """A ground of 100 x 100 at 0, and above it squares of 20 x 20 side by side."""
    small = [moved(grid(5, size=20.0), (30.0 * i - 30.0, 0.0, z)) for i, z in enumerate(heights)]
    return joined(grid(9), *small)


@pytest.fixture(scope="module")
def ball():
    return sphere(40)


def test_a_sphere_is_like_itself(ball):
    quality = measure_relief(ball, ball, size=128, similarity=True)
    assert quality.normal_angles == (0.0,) * 7
    assert quality.silhouette_overlaps == (1.0,) * 7
    assert quality.similarities == pytest.approx((1.0,) * 7, abs=1e-12)
    assert quality.views == SEVEN_VIEWS


@pytest.mark.parametrize("factor", [0.5, 0.1])
@pytest.mark.parametrize("axis", [0, 1])
def test_tilted_plane(factor, axis):
    vertices, faces = grid(9)
    vertices[:, 2] = 0.7 * vertices[:, axis]
    quality = measure_relief((vertices, faces), scaled((vertices, faces), factor), size=64)
    expected = np.degrees(np.arctan(0.7) - np.arctan(0.7 * factor))
    assert quality.normal_angles == pytest.approx((expected,) * 7, abs=1e-4)
    assert quality.mean_angle == pytest.approx(expected, abs=1e-4)


@pytest.mark.parametrize("factor", [0.5, 0.25, 0.1])
def test_half_sphere(factor):
    # Over the disc r = sin(t): the integral of (t - arctan(s tan t)) sin(2 t) is pi/4 - pi s / (2 + 2 s).
    body = half_sphere()
    quality = measure_relief(body, scaled(body, factor), views=FRONT, size=256)
    assert quality.normal_angles[0] == pytest.approx(45.0 * (1 - factor) / (1 + factor), abs=0.1)


def test_silhouettes():
    vertices, faces = grid(9)
    left = (vertices[faces].mean(axis=1)[:, 0] < 0.0).nonzero()[0]
    quality = measure_relief((vertices, faces), (vertices, faces[left]), views=FRONT, size=128)
    assert quality.silhouette_overlaps[0] == pytest.approx(0.5, abs=0.02)


def test_no_common_pixel():
    left, right = moved(grid(3, size=20.0), (-40.0, 0.0, 0.0)), moved(grid(3, size=20.0), (40.0, 0.0, 0.0))
    quality = measure_relief(joined(left, right), left, views=FRONT, size=64)
    assert quality.silhouette_overlaps[0] == pytest.approx(0.5)
    assert np.isnan(
        measure_relief(left, moved(left, (50.0, 0.0, 0.0)), views=FRONT, size=64).normal_angles[0]
    )


def test_discontinuities_are_counted_along_the_edges():
    size = 250
    quality = measure_relief(plates(20.0), scaled(plates(20.0), 0.1), views=FRONT, size=size)
    across = 20.0 / (100.0 / 0.92 / size)  # pixels along an edge; the margin takes 8 %
    assert quality.discontinuities == pytest.approx(4 * across, abs=4)
    assert quality.discontinuities_kept == 1.0


def test_a_flat_relief_keeps_no_discontinuity():
    assert measure_relief(plates(20.0), grid(9), views=FRONT, size=64).discontinuities_kept == 0.0


@pytest.mark.parametrize(("lower", "kept"), [(2.0, 1.0), (1.1, 1.0), (0.9, 0.5), (-1.0, 0.5)])
def test_discontinuities_kept(lower, kept):
    # Both squares stand out from the ground; linear scaling would put the lower one at 2.
    quality = measure_relief(plates(20.0, 40.0), plates(lower, 4.0), views=FRONT, size=128)
    assert quality.discontinuities_kept == pytest.approx(kept, abs=0.01)


def test_steep_slopes_are_no_discontinuities():
    steep = scaled(hills(41), 20.0)
    quality = measure_relief(steep, steep, views=FRONT, size=64)
    assert quality.discontinuities == 0
    assert np.isnan(quality.discontinuities_kept)


def test_order_and_what_lies_behind():
    scene = plates(20.0)
    vertices, _ = scene
    yardstick = Yardstick(scene, views=FRONT, size=64)
    ground, square = vertices[:, 2] == 0.0, vertices[:, 2] > 0.0

    kept = yardstick.measure(scene, heights=vertices[:, 2])
    assert kept.pairs_tested > 10_000
    assert (kept.order_inversions, kept.visible_behind) == (0, 0)
    assert kept.visible_tested == (81 - 2) + 25  # two vertices of the ground lie under the square

    swapped = yardstick.measure(scene, heights=np.where(ground, 5.0, 1.0))
    assert swapped.order_inversions == swapped.pairs_tested == kept.pairs_tested
    sunk = yardstick.measure(scene, heights=np.where(square, 5.0, -1.0))
    assert (sunk.order_inversions, sunk.visible_behind) == (0, 79)
    both_behind = yardstick.measure(scene, heights=np.where(ground, -1.0, -2.0))
    assert (both_behind.order_inversions, both_behind.visible_behind) == (0, 104)

    unknown = yardstick.measure(scene)
    assert unknown.pairs_tested is unknown.order_inversions is None
    assert unknown.visible_tested is unknown.visible_behind is None


def test_vertices_that_no_face_uses_do_not_count():
    vertices, faces = plates(20.0)
    more = np.concatenate([[[1e6, 0.0, np.nan]], vertices])
    plain = measure_relief((vertices, faces), (vertices, faces), heights=vertices[:, 2], size=64)
    padded = measure_relief((more, faces + 1), (more, faces + 1), heights=more[:, 2], size=64)
    assert padded == plain


def test_unit_and_place_do_not_matter():
    scene, relief = bust(24), scaled(bust(24), 0.2)
    plain = measure_relief(scene, relief, heights=relief[0][:, 2], size=96)
    small = measure_relief(
        (scene[0] / 64, scene[1]), (relief[0] / 64, relief[1]), heights=relief[0][:, 2] / 64, size=96
    )
    assert small.normal_angles == plain.normal_angles
    assert (small.order_inversions, small.visible_behind) == (plain.order_inversions, plain.visible_behind)
    assert small.depth == pytest.approx(plain.depth / 64)
    assert small.scene_depth == pytest.approx(plain.scene_depth / 64)
    # Neither the place of S nor a hidden back shifts the pictures.
    raised = measure_relief(scene, moved(relief, (0.0, 0.0, 8.0)), size=96)
    assert raised.normal_angles == pytest.approx(plain.normal_angles, abs=0.2)


def test_a_hidden_back_does_not_shift_the_pictures():
    front = hills(31)
    backed = joined(front, moved(grid(5, size=90.0), (0.0, 0.0, -200.0)))
    assert measure_relief(backed, front, views=FRONT, size=96).normal_angles[0] < 0.05
    # From 20 degrees the back itself comes into view beside the front; where both cover, they are alike.
    assert measure_relief(backed, front, views=[(20.0, 0.0)], size=96).normal_angles[0] < 0.05


def test_depths():
    quality = measure_relief(plates(20.0), scaled(plates(20.0), 0.25), views=FRONT, size=64)
    assert (quality.scene_depth, quality.depth) == (20.0, 5.0)


def test_meshes_and_arrays_are_the_same():
    scene, relief = bust(16), scaled(bust(16), 0.3)
    assert measure_relief(to_mesh(scene), to_mesh(relief), size=64) == measure_relief(scene, relief, size=64)


def test_unwelded_meshes_are_the_same():
    scene, relief = bust(16), scaled(bust(16), 0.3)
    plain = measure_relief(scene, relief, size=64)
    loose = measure_relief(exploded(scene), exploded(relief), size=64)
    assert loose.normal_angles == plain.normal_angles


def test_similarity_falls_with_the_depth(ball):
    yardstick = Yardstick(ball, views=FRONT, size=128)
    values = [yardstick.measure(scaled(ball, s), similarity=True).similarities[0] for s in (0.9, 0.4, 0.1)]
    assert 1.0 > values[0] > values[1] > values[2] > 0.0


def test_similarity_needs_scikit_image(ball, monkeypatch):
    monkeypatch.setitem(sys.modules, "skimage.metrics", None)
    with pytest.raises(ReliefError, match="pip install scikit-image"):
        measure_relief(ball, ball, views=FRONT, size=16, similarity=True)


@pytest.mark.parametrize("size", [7, 8193, 64.5, "64"])
def test_bad_size(ball, size):
    with pytest.raises(ParameterError, match="size must be a whole number"):
        Yardstick(ball, size=size)


@pytest.mark.parametrize(
    "views", [(), [(0.0, 0.0, 0.0)], None, 5, [0, 20], [("a", "b")], [(np.nan, 0.0)], [(0, 0), (1,)]]
)
def test_bad_views(ball, views):
    with pytest.raises(ParameterError, match="views must be pairs"):
        Yardstick(ball, views=views)


@pytest.mark.parametrize("heights", [np.zeros(3), np.full(1, np.nan)])
def test_bad_heights(ball, heights):
    wrong = heights if len(heights) == 3 else np.full(len(ball[0]), np.nan)
    with pytest.raises(ParameterError, match="heights must be"):
        measure_relief(ball, ball, views=FRONT, size=16, heights=wrong)
    with pytest.raises(ParameterError, match="heights must be numbers"):
        measure_relief(ball, ball, views=FRONT, size=16, heights="high")


def test_whole_numbers_of_numpy(ball):
    assert Yardstick(ball, views=np.zeros((1, 2)), size=np.int64(16)).measure(ball).mean_angle == 0.0


def test_a_scene_without_an_extent():
    point = np.zeros((3, 3)), np.array([[0, 1, 2]])
    with pytest.raises(MeshError, match="nothing to compare"):
        Yardstick(point)
    with pytest.raises(MeshError, match=r"vertices and faces\. Got 3 arrays"):
        Yardstick((*point, None))


def test_bad_arrays(ball):
    with pytest.raises(MeshError, match=r"vertices must be of the shape \(count, 3\)"):
        measure_relief((ball[0][:, :2], ball[1]), ball)
    with pytest.raises(MeshError, match="no triangles"):
        measure_relief(ball, (ball[0], ball[1][:0]))


def test_quality_is_frozen(ball):
    quality = measure_relief(ball, ball, views=FRONT, size=16)
    assert isinstance(quality, ReliefQuality)
    with pytest.raises(AttributeError):
        quality.depth = 1.0


def test_a_relief_is_laid_over_its_scene():
    mesh = arrays_mesh(*plates(20.0))
    mesh.rotate(mesh.get_rotation_matrix_from_xyz((np.pi / 2, 0.0, 0.0)), (0, 0, 0)).translate((300, 7, -40))
    relief = make_relief(mesh, ReliefParams(depth="50%"), view=View(front="-y", up="z"))
    quality = measure_relief(mesh, relief, views=FRONT, size=64)
    assert quality.silhouette_overlaps == pytest.approx((1.0,), abs=1e-3)
    assert quality.normal_angles[0] < 1.0
    placed = type(mesh)(mesh).transform(np.linalg.inv(relief.to_scene))
    same = measure_relief(placed, relief.mesh, views=FRONT, size=64)
    assert same.normal_angles == pytest.approx(quality.normal_angles, abs=1e-6)
