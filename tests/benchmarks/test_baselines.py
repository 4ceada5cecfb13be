import numpy as np
import pytest

import o3d_relief as rel
from baselines.cignoni import depth_compression
from baselines.height_field import HeightField, sample
from baselines.linear import linear_scaling
from baselines.schueller import appearance_mimicking, energy
from baselines.weyrich import attenuate, bas_relief, integrate
from o3d_relief.linalg.laplacian import vertex_areas
from o3d_relief.stages.visibility import visible_vertices
from shapes import bust, grid, hills, joined, moved


def field(z):
    z = np.asarray(z, dtype=float)
    return HeightField(x=np.arange(z.shape[1]) + 0.5, y=np.arange(z.shape[0]) + 0.5, z=z, step=1.0)


def bumps(side=40):
    x, y = np.meshgrid(np.arange(side), np.arange(side))
    return 5.0 * np.sin(x / 4.0) * np.cos(y / 5.0) + 0.02 * x**2


@pytest.mark.parametrize("method", [linear_scaling, depth_compression])
def test_visible_depth_is_exact_and_order_is_kept(method):
    rng = np.random.default_rng(1)
    z = np.sort(rng.normal(size=200)) * 30
    visible = rng.random(200) < 0.5
    visible[-1] = True
    new = method(z, visible, 7.0)
    assert new[visible].min() == pytest.approx(0.0, abs=1e-12)
    assert new[visible].max() == pytest.approx(7.0)
    assert (np.diff(new) > 0.0).all()


def test_depth_compression_shrinks_the_far_most():
    z = np.linspace(0.0, 80.0, 50)
    steps = np.diff(depth_compression(z, np.ones(50, dtype=bool), 20.0))
    assert (np.diff(steps) > 0.0).all()
    # The slope of t / (d + t) is d / (d + t)^2: over t = 80 at d = 100 it falls by 1.8^2.
    assert steps[-1] / steps[0] == pytest.approx(1.8**2, rel=0.03)


def test_depth_compression_from_far_away_is_linear():
    z, visible = np.linspace(0.0, 80.0, 50), np.ones(50, dtype=bool)
    far = depth_compression(z, visible, 20.0, distance=1e9)
    assert far == pytest.approx(linear_scaling(z, visible, 20.0), abs=1e-5)


def test_sample_and_triangulate():
    vertices, faces = grid(5)
    vertices[:, 2] = 0.3 * vertices[:, 0] - 0.2 * vertices[:, 1]
    sampled = sample(vertices, faces, side=50)
    x, y = np.meshgrid(sampled.x, sampled.y)
    assert sampled.z.shape == (50, 50)
    assert sampled.z == pytest.approx(0.3 * x - 0.2 * y, abs=1e-4)
    made, triangles = sampled.triangulate()
    a, b, c = made[triangles].transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    assert (normals[:, 2] > 0.0).all()
    assert normals[:, 2].sum() / 2 == pytest.approx((49 * sampled.step) ** 2)


def test_triangulate_leaves_holes():
    z = np.zeros((3, 3))
    z[0, 0] = np.nan
    vertices, faces = field(z).triangulate()
    assert len(vertices) == 8
    assert len(faces) == 3 * 2 + 1  # three whole cells, half of the fourth
    z[1, 1] = np.nan
    assert len(field(z).triangulate()[1]) == 3  # two corners are missing at the first cell


def test_attenuation_keeps_small_slopes_and_shrinks_large_ones():
    slopes = np.array([1e-6, 0.5, 2.0, 10.0])
    ratio = attenuate(slopes, 2.0) / slopes
    assert ratio[0] == pytest.approx(1.0, abs=1e-5)
    assert (np.diff(ratio) < 0.0).all()
    assert attenuate(slopes, 1e-9) == pytest.approx(slopes, rel=1e-6)


def test_integration_undoes_differences():
    z = bumps()
    z[:12, 25:] = np.nan
    z[20, :] = np.nan  # two pieces
    there = np.isfinite(z)
    found = integrate(np.diff(z, axis=1, append=np.nan), np.diff(z, axis=0, append=np.nan), there)
    assert np.array_equal(np.isfinite(found), there)
    for piece in (slice(0, 20), slice(21, 40)):
        shift = (found - z)[piece]
        assert np.nanmax(shift) - np.nanmin(shift) < 1e-5
        assert np.nanmean(found[piece]) == pytest.approx(0.0, abs=1e-4)


def test_without_its_means_the_bas_relief_is_linear_scaling():
    z = bumps()
    made = bas_relief(field(z), 2.0, alpha=1e-9, silhouette=np.inf, weights=(1.0, 1.0))
    assert made.z == pytest.approx((z - z.min()) * 2.0 / np.ptp(z), abs=1e-5)


def test_silhouettes_are_removed_and_the_depth_goes_to_the_detail():
    z = bumps()
    step = z + 100.0 * (np.arange(40) >= 20)
    made = bas_relief(field(step), 2.0, alpha=1e-9, weights=(1.0, 1.0)).z
    linear = (step - step.min()) * 2.0 / np.ptp(step)
    jump = (slice(None), 20), (slice(None), 19)
    assert np.abs(made[jump[0]] - made[jump[1]]).max() < 0.3  # of 100 in 117
    assert np.ptp(made[:, :19]) > 3.0 * np.ptp(linear[:, :19])


def test_bands_hold_back_large_shapes():
    z = bumps()
    fine = bas_relief(field(z), 2.0, alpha=1e-9, silhouette=np.inf, scales=(3.0,), weights=(1.0, 0.2)).z
    plain = bas_relief(field(z), 2.0, alpha=1e-9, silhouette=np.inf, weights=(1.0, 1.0)).z
    rows, columns = fine.mean(axis=1), fine.mean(axis=0)

    def detail(heights):
        return np.abs(np.diff(heights, 2, axis=0)).mean() / np.ptp(heights)

    assert detail(fine) > 1.1 * detail(plain)
    assert rows.shape == columns.shape


def test_mimicking_energy_is_the_limit_of_the_published_one():
    vertices, faces = bust(10)
    n = len(vertices)
    rng = np.random.default_rng(3)
    displacement = rng.normal(size=n)
    weights = rng.random(n) + 0.5
    stiffness, _ = rel.cotangent_laplacian(vertices, faces)
    areas = vertex_areas(vertices, faces)

    def literal(viewer):
        rays = vertices - viewer
        old = np.linalg.norm(rays, axis=1)
        directions = rays / old[:, None]
        # Along its ray a vertex goes towards the viewer by as much as z grows.
        new = old - displacement
        curvature = (stiffness @ (directions * new[:, None])) / areas[:, None]
        wanted = (stiffness @ (directions * old[:, None])) / areas[:, None]
        change = curvature - wanted * (new / old)[:, None]
        return float((weights**2 * areas * (change**2).sum(axis=1)).sum())

    limit = float(displacement @ (energy(vertices, faces, weights) @ displacement))
    errors = [abs(literal(np.array([0.0, 0.0, far])) / limit - 1.0) for far in (1e4, 1e6)]
    assert errors[1] < 1e-4
    assert errors[1] < errors[0] < 2e-2


@pytest.fixture(scope="module")
def head():
    vertices, faces = bust(24)
    vertices[:, 2] -= vertices[:, 2].min()
    return vertices, faces, visible_vertices(vertices, faces)


def test_mimicking_is_free_of_change_where_there_is_room(head):
    vertices, faces, visible = head
    z = appearance_mimicking(vertices, faces, visible, 200.0)
    assert np.ptp(z - vertices[:, 2]) < 2.0  # of 140: what holds loose parts pulls a little


def test_mimicking_keeps_its_bounds_and_is_the_best(head):
    vertices, faces, visible = head
    depth = 15.0
    z = appearance_mimicking(vertices, faces, visible, depth)
    assert z.min() >= 0.0
    assert z.max() <= depth
    form = energy(vertices, faces, np.where(visible, 1.0, 0.1))

    def cost(heights):
        change = heights - vertices[:, 2]
        return float(change @ (form @ change))

    best = cost(z)
    linear = np.clip(linear_scaling(vertices[:, 2], visible, depth), 0.0, depth)
    assert best < 0.7 * cost(linear)
    rng = np.random.default_rng(0)
    for share in (0.5, 0.1, 0.01):  # a convex problem: no way towards any other relief goes down
        for other in (linear, rng.random(len(z)) * depth, np.zeros(len(z))):
            assert cost(z + share * (other - z)) >= best * (1.0 - 1e-6)


def test_mimicking_on_a_decimated_mesh_is_close(head):
    vertices, faces, visible = head
    whole = appearance_mimicking(vertices, faces, visible, 15.0)
    part = appearance_mimicking(vertices, faces, visible, 15.0, largest=len(vertices) // 2)
    assert np.abs(part - whole)[visible].mean() < 0.1 * 15.0


def test_mimicking_holds_loose_parts():
    scene = joined(hills(11), moved(grid(4, size=20.0), (0.0, 0.0, 60.0)))
    vertices, faces = scene[0] - [0.0, 0.0, scene[0][:, 2].min()], scene[1]
    visible = visible_vertices(vertices, faces)
    z = appearance_mimicking(vertices, faces, visible, 20.0)
    assert z[121:] == pytest.approx(np.full(16, 20.0), abs=1.0)
