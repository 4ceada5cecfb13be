"""From a point cloud to a mesh: what is kept, what is cut away, what is refused."""

import contextlib
import copy
import pickle

import numpy as np
import open3d as o3d
import pytest
from scipy.spatial import cKDTree

import o3d_relief as rel
from shapes import bust, hills, to_mesh, turn

STAGES = ["points", "outliers", "normals", "ground", "orientation", "surface", "skin", "parts"]


def to_cloud(points, *, normals=None, colors=None):
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(np.array(points, dtype=float)))
    if normals is not None:
        cloud.normals = o3d.utility.Vector3dVector(np.array(normals, dtype=float))
    if colors is not None:
        cloud.colors = o3d.utility.Vector3dVector(np.array(colors, dtype=float))
    return cloud


def sampled(shape, count, *, seed=0):
    """Draw random points of a shape, uniformly by area, with the normals of their triangles."""
    vertices, faces = shape
    random = np.random.default_rng(seed)
    a, b, c = vertices[faces].transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    area = np.linalg.norm(normal, axis=1)
    chosen = random.choice(len(faces), count, p=area / area.sum())
    s, t = np.sqrt(random.random((count, 1))), random.random((count, 1))
    points = (1 - s) * a[chosen] + s * (1 - t) * b[chosen] + s * t * c[chosen]
    return points, normal[chosen] / area[chosen, None]


def away(mesh, points):
    """Return the distances (n,) of points from a mesh."""
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(o3d.t.geometry.TriangleMesh.from_legacy(mesh))
    return scene.compute_distance(np.asarray(points, dtype=np.float32)).numpy()


def vertices_of(mesh):
    return np.asarray(mesh.vertices)


@pytest.fixture(scope="module")
def body():
    return bust(60)


@pytest.fixture(scope="module")
def points(body):
    return sampled(body, 6000)


@pytest.fixture(scope="module")
def scan(points):
    return rel.scan_points(to_cloud(points[0]))


def test_mesh_is_the_body_within_a_spacing(scan, body):
    spacing = scan.stages["points"].spacing
    assert np.percentile(away(to_mesh(body), vertices_of(scan.mesh)), 95) < 0.5 * spacing
    assert np.percentile(away(scan.mesh, body[0]), 95) < spacing


def test_faces_turn_outwards(scan):
    assert scan.mesh.is_watertight()
    assert scan.mesh.get_volume() > 0
    a, b, c = vertices_of(scan.mesh)[np.asarray(scan.mesh.triangles)].transpose(1, 0, 2)
    assert (np.cross(a, b) * c).sum() > 0


def test_records_are_all_there_in_order_read_only_and_picklable(scan):
    assert list(scan.stages) == STAGES
    for name, record in scan.stages.items():
        assert record.name == name
        for again in (pickle.loads(pickle.dumps(record)), copy.deepcopy(record)):
            assert again.counts == record.counts
        for value in vars(record).values():
            if isinstance(value, np.ndarray):
                with pytest.raises(ValueError, match="read-only"):
                    value[...] = 0
    assert len(repr(scan)) < 200
    for again in (pickle.loads(pickle.dumps(scan)), copy.deepcopy(scan)):
        assert np.array_equal(again.mesh.vertices, scan.mesh.vertices)
        assert list(again.stages) == STAGES
        assert again.params == scan.params

    class Own(rel.Scan):
        pass

    own = copy.copy(Own(mesh=scan.mesh, stages=scan.stages, params=scan.params))
    assert type(own) is Own
    assert list(own.stages) == STAGES


def test_cloud_is_not_changed_and_its_mesh_can_be(points):
    cloud = to_cloud(points[0], normals=points[1])
    mesh = rel.mesh_from_points(cloud)
    assert np.array_equal(np.asarray(cloud.points), points[0])
    assert np.array_equal(np.asarray(cloud.normals), points[1])
    np.asarray(mesh.vertices)[0] = 7.0


def test_the_same_cloud_gives_the_same_bytes(points, scan):
    again = rel.mesh_from_points(to_cloud(points[0]))
    assert np.array_equal(vertices_of(again), vertices_of(scan.mesh))
    assert np.array_equal(np.asarray(again.triangles), np.asarray(scan.mesh.triangles))


@pytest.mark.parametrize(("scale", "offset"), [(1e-6, 0.0), (1.0, 5e6), (1e6, -1e9)])
def test_units_and_far_origins_do_not_matter(points, scan, scale, offset):
    mesh = rel.mesh_from_points(to_cloud(points[0] * scale + offset))
    back = (vertices_of(mesh) - offset) / scale
    near = cKDTree(back).query(vertices_of(scan.mesh))[0]
    assert np.percentile(near, 95) < 0.2 * scan.stages["points"].spacing


def test_outliers_and_bad_numbers_go(points, scan):
    random = np.random.default_rng(1)
    stray = random.uniform(-150, 150, (200, 3))
    stray = stray[np.linalg.norm(stray, axis=1) > 95]
    bad = [[np.nan, 0, 0], [0, np.inf, 0], [0, 0, -np.inf]]
    dirty = rel.scan_points(to_cloud(np.concatenate([bad, points[0], stray, points[0][:500]])))
    assert dirty.stages["points"].counts["not_finite"] == 3
    assert dirty.stages["points"].counts["repeated"] == 500
    assert dirty.stages["outliers"].outlier[len(points[0]) :].all()
    near = cKDTree(vertices_of(scan.mesh)).query(vertices_of(dirty.mesh))[0]
    assert near.max() < 2 * scan.stages["points"].spacing


def test_outliers_stay_where_all_are_wanted(points):
    cloud = to_cloud(np.concatenate([points[0], [[400.0, 0, 0]]]))
    assert rel.scan_points(cloud, rel.ScanParams(outliers=None)).stages["outliers"].counts["outliers"] == 0


@pytest.mark.parametrize("given", ["good", "short", "inwards"])
def test_the_clouds_own_normals_are_used(points, scan, given):
    normals = points[1] * {"good": 1.0, "short": 0.01, "inwards": -3.0}[given]
    own = rel.scan_points(to_cloud(points[0], normals=normals))
    assert own.stages["normals"].from_file
    assert own.stages["orientation"].method == "cloud"
    assert ((own.stages["orientation"].normals * points[1]).sum(axis=1) > 0).mean() > 0.99
    assert own.mesh.get_surface_area() == pytest.approx(scan.mesh.get_surface_area(), rel=0.02)


def test_single_bad_normals_are_estimated_anew(points):
    normals = points[1].copy()
    normals[:100] = 0.0
    normals[100:200] = np.nan
    normals[200:300] = np.cross(normals[200:300], [0.3, -0.5, 0.8])
    stages = rel.scan_points(to_cloud(points[0], normals=normals)).stages
    assert stages["normals"].from_file
    assert stages["normals"].counts["own_zero"] == 200
    assert stages["normals"].counts["own_off"] >= 100
    right = (stages["orientation"].normals * points[1]).sum(axis=1) > 0.5
    assert right[:300].mean() > 0.97


def test_normals_that_point_anywhere_are_not_used(points, scan):
    random = np.random.default_rng(0).normal(size=points[0].shape)
    stages = rel.scan_points(to_cloud(points[0], normals=random)).stages
    assert not stages["normals"].from_file
    assert np.array_equal(stages["parts"].vertices, vertices_of(scan.mesh))


def test_normals_of_mixed_signs_are_turned(points):
    for sign in (np.random.default_rng(9).choice([-1.0, 1.0], 6000), np.sign(points[0][:, 0])):
        _check_mixed(points, sign)


def _check_mixed(points, sign):
    stages = rel.scan_points(to_cloud(points[0], normals=points[1] * sign[:, None])).stages
    assert stages["normals"].from_file
    assert stages["orientation"].method == "propagation"
    assert ((stages["orientation"].normals * points[1]).sum(axis=1) > 0).mean() > 0.99


def test_the_clouds_own_normals_are_left_out_where_they_are_not_wanted(points, scan):
    cloud = to_cloud(points[0], normals=-points[1])
    mesh = rel.mesh_from_points(cloud, rel.ScanParams(file_normals=False))
    assert np.array_equal(vertices_of(mesh), vertices_of(scan.mesh))


@pytest.fixture(scope="module")
def sheet():
    return sampled(hills(), 6000, seed=2)[0]


class TestOneSide:
    """A sheet seen from one side: a range image, a facade."""

    @pytest.mark.parametrize("front", [(0, 0, 1), (0, 0, -1)])
    def test_the_back_stays_open_and_the_front_is_the_view_s(self, sheet, front):
        scan = rel.scan_points(to_cloud(sheet), view=rel.View(front=front))
        spacing = scan.stages["points"].spacing
        assert np.percentile(away(to_mesh(hills()), vertices_of(scan.mesh)), 90) < 0.3 * spacing
        assert np.percentile(away(to_mesh(hills()), vertices_of(scan.mesh)), 99.9) < 2 * spacing
        area = to_mesh(hills()).get_surface_area()
        assert 0.9 * area < scan.mesh.get_surface_area() < 1.06 * area
        scan.mesh.compute_triangle_normals()
        assert (np.asarray(scan.mesh.triangle_normals)[:, 2] * front[2] > 0).mean() > 0.99

    def test_no_skin_around_it(self, sheet):
        scan = rel.scan_points(to_cloud(sheet))
        reach = cKDTree(sheet).query(vertices_of(scan.mesh))[0] / scan.stages["points"].spacing
        assert np.percentile(reach, 99) < 1.3
        low, high = vertices_of(scan.mesh).min(axis=0), vertices_of(scan.mesh).max(axis=0)
        assert (np.abs(low[:2] + 50) < 3).all()
        assert (np.abs(high[:2] - 50) < 3).all()

    def test_a_sensor_decides(self, sheet):
        stages = rel.scan_points(to_cloud(sheet), rel.ScanParams(sensor=(0, 0, -500))).stages
        assert stages["orientation"].method == "sensor"
        assert (stages["orientation"].normals[:, 2] < 0).mean() > 0.99

    def test_a_regular_grid(self):
        scan = rel.scan_points(to_cloud(hills(80)[0]))
        assert (
            np.percentile(away(to_mesh(hills(80)), vertices_of(scan.mesh)), 90)
            < 0.3 * scan.stages["points"].spacing
        )
        assert len(scan.mesh.cluster_connected_triangles()[1]) == 1

    def test_a_flat_wall(self):
        wall = np.random.default_rng(0).random((4000, 3)) * [10, 10, 0]
        mesh = rel.mesh_from_points(to_cloud(wall))
        assert np.abs(vertices_of(mesh)[:, 2]).max() < 0.1 * 10 / np.sqrt(4000)
        assert mesh.get_surface_area() == pytest.approx(100.0, rel=0.08)

    def test_turned_scans_give_the_same_surface(self, sheet):
        rotation = turn(4)
        view = rel.View(front=rotation[:, 2], up=rotation[:, 1])
        mesh = rel.mesh_from_points(to_cloud(sheet @ rotation.T), view=view)
        assert np.percentile(away(to_mesh(hills()), vertices_of(mesh) @ rotation), 99) < 1.3


def test_a_small_hole_is_closed_and_a_large_one_stays(points):
    for radius, closed in ((4.0, True), (20.0, False)):
        at = points[0][np.argmax(points[0][:, 2])]
        holed = points[0][np.linalg.norm(points[0] - at, axis=1) > radius]
        mesh = rel.mesh_from_points(to_cloud(holed))
        assert mesh.is_edge_manifold(allow_boundary_edges=False) == closed


def test_colors_are_carried(points):
    colors = (points[0] - points[0].min(axis=0)) / np.ptp(points[0], axis=0)
    scan = rel.scan_points(to_cloud(points[0], colors=colors))
    wanted = (vertices_of(scan.mesh) - points[0].min(axis=0)) / np.ptp(points[0], axis=0)
    assert np.abs(np.asarray(scan.mesh.vertex_colors) - wanted).max() < 0.05


def test_the_ground_goes_on_request():
    ball = np.random.default_rng(0).normal(size=(6000, 3))
    ball = 10.0 * ball / np.linalg.norm(ball, axis=1, keepdims=True) + [0, 10, 0]
    floor = np.random.default_rng(1).uniform(-30, 30, (8000, 3)) * [1, 0, 1]
    cloud = to_cloud(np.concatenate([ball, floor]))
    with_floor = rel.scan_points(cloud)
    without = rel.scan_points(cloud, rel.ScanParams(remove_ground=True))
    assert vertices_of(with_floor.mesh)[:, 0].max() > 25
    assert vertices_of(without.mesh)[:, 0].max() < 11
    assert without.stages["ground"].ground[6000:].all()


def test_large_clouds_are_thinned(points):
    stages = rel.scan_points(to_cloud(points[0]), rel.ScanParams(max_points=4000)).stages
    assert 3000 < len(stages["points"].points) <= 4000
    assert stages["points"].counts["thinned"] == 6000 - len(stages["points"].points)
    assert np.array_equal(points[0][stages["points"].cloud_index], stages["points"].points)


def test_small_parts_go_and_large_ones_stay(points):
    crumb = sampled(bust(20), 400, seed=3)[0] * 0.15 + [90, 0, 0]
    cloud = to_cloud(np.concatenate([points[0], crumb]))
    reach = [
        vertices_of(rel.mesh_from_points(cloud, rel.ScanParams(min_part=share)))[:, 0].max() > 80
        for share in (0.0, 0.2)
    ]
    assert reach == [True, False]


class TestRelief:
    def test_make_relief_takes_a_cloud(self, points):
        names = []
        relief = rel.make_relief(
            to_cloud(points[0], colors=np.full_like(points[0], 0.4)),
            rel.ReliefParams(k=16),
            scan=rel.ScanParams(depth=6),
            on_stage=lambda stage: names.append(stage.name),
        )
        assert names == list(relief.stages)
        assert names[:9] == [*STAGES, "scene"]
        assert relief.scan.depth == relief.report()["scan"]["depth"] == 6
        assert relief.mesh.has_vertex_colors()
        assert relief.stages["surface"].depth == 6
        inside = relief.source_index[relief.source_index >= 0]
        assert inside.max() < len(relief.stages["parts"].vertices)

    def test_a_scan_is_gone_on_with(self, points):
        scan = rel.scan_points(to_cloud(points[0]), rel.ScanParams(depth=6))
        relief = rel.make_relief(scan, rel.ReliefParams(k=16))
        assert list(relief.stages)[:8] == list(STAGES)
        assert relief.scan == scan.params

    def test_a_mesh_has_no_scan(self):
        relief = rel.make_relief(to_mesh(hills()), rel.ReliefParams(k=8))
        assert relief.scan is relief.report()["scan"] is None

    def test_scan_params_for_a_mesh_are_refused(self):
        with pytest.raises(rel.ParameterError, match="scan says how a point cloud is meshed"):
            rel.make_relief(to_mesh(hills()), scan=rel.ScanParams())


class TestRefusals:
    @pytest.mark.parametrize(
        ("cloud", "reason"),
        [
            (o3d.geometry.TriangleMesh(), r"must be an open3d\.geometry\.PointCloud\. Got a .*TriangleMesh"),
            (None, "Got a builtins.NoneType"),
            (o3d.geometry.TriangleMesh(), "TriangleMesh instead: it is a mesh already"),
            (o3d.t.geometry.PointCloud(), r"instead: take what its to_legacy\(\) returns"),
            ("lion.ply", "instead: read the file with read_points"),
            (to_cloud(np.zeros((0, 3))), "it has no points"),
            (to_cloud(np.eye(3)), "at least 50 points. Got the 3 points of the cloud, 3 of them finite"),
            (to_cloud(np.full((90, 3), np.nan)), "Got the 90 points of the cloud, 0 of them finite"),
            (to_cloud(np.ones((90, 3))), "Got the 90 points of the cloud, 1 of them apart"),
            (to_cloud(np.arange(90)[:, None] * [1.0, 2, 3]), "0 points of the cloud that lie on a surface"),
            (
                to_cloud([[1e308, 0, 0], [-1e308, 0, 0], *np.random.default_rng(0).random((90, 3))]),
                "spread over 1e\\+308, which is too far",
            ),
        ],
    )
    def test_clouds_without_a_surface(self, cloud, reason):
        with pytest.raises(rel.MeshError, match=reason):
            rel.mesh_from_points(cloud)

    def test_a_sensor_out_of_this_world(self, points):
        with pytest.raises(rel.ParameterError, match=r"sensor is too far from the points\. Got \(1e\+300"):
            rel.mesh_from_points(to_cloud(points[0]), rel.ScanParams(sensor=(1e300, 0, 0)))

    @pytest.mark.parametrize("seed", range(4))
    @pytest.mark.parametrize("count", [50, 90, 200])
    def test_points_without_any_order_end_in_a_mesh_or_an_error(self, seed, count):
        cloud = to_cloud(np.random.default_rng(seed).random((count, 3)))
        with contextlib.suppress(rel.MeshError):
            assert len(rel.mesh_from_points(cloud).triangles)

    @pytest.mark.parametrize(("name", "value"), [("params", rel.ReliefParams()), ("view", "z")])
    def test_arguments_of_another_kind(self, points, name, value):
        with pytest.raises(rel.ParameterError, match=f"{name} must be a "):
            rel.scan_points(to_cloud(points[0]), **{name: value})


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({"sensor": (1, 2)}, "sensor must be three numbers"),
        ({"remove_ground": 1}, "remove_ground must be True or False"),
        ({"file_normals": "no"}, "file_normals must be True or False"),
        ({"depth": 14}, "depth must be a whole number between 3 and 13"),
        ({"depth": 8.5}, "depth must be a whole number"),
        ({"max_points": 10}, "max_points must be"),
        ({"outliers": 0}, "outliers must be greater than 0"),
        ({"max_hole": -1}, "max_hole must be at least 0"),
        ({"min_part": 2}, "min_part must be between 0 and 1"),
        ({"threads": 0}, "threads must be"),
        ({"seed": -1}, "seed must be"),
    ],
)
def test_parameters_out_of_range(values, sentence):
    with pytest.raises(rel.ParameterError, match=f"{sentence}.*Got"):
        rel.ScanParams(**values)
