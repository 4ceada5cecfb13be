import copy
import json
import os
import pickle
import subprocess
import sys
from dataclasses import fields
from pathlib import Path

import numpy as np
import open3d as o3d
import pytest

import o3d_relief as rel
import oracle
from o3d_relief.records import VisibilityStage
from shapes import bust, exploded, grid, hills, joined, moved, sphere, to_mesh, turn

STAGES = [
    "scene",
    "perspective",
    "visibility",
    "clusters",
    "attenuation",
    "construction",
    "restoration",
    "order",
    "compression",
    "trim",
]
PARAMS = rel.ReliefParams(k=24)


@pytest.fixture(scope="module")
def mesh():
    return to_mesh(bust())


@pytest.fixture(scope="module")
def relief(mesh):
    return rel.make_relief(mesh, PARAMS)


def _snapshot(mesh):
    return [np.array(getattr(mesh, name)) for name in ("vertices", "triangles", "vertex_normals")]


def test_stages_are_all_there_in_order_timed_and_read_only(relief):
    assert list(relief.stages) == STAGES
    for name, record in relief.stages.items():
        assert record.name == name
        assert record.seconds >= 0
        for value in vars(record).values():
            if isinstance(value, np.ndarray):
                with pytest.raises(ValueError, match="read-only"):
                    value[...] = 0
    with pytest.raises(TypeError):
        relief.stages["scene"].counts["faces"] = 0


def test_arrays_of_the_relief_are_read_only(relief):
    for value in (relief.to_scene, relief.source_index):
        with pytest.raises(ValueError, match="read-only"):
            value[...] = 0


def test_records_survive_pickling_and_copying_and_leave_their_source_alone(relief):
    for record in relief.stages.values():
        for again in (pickle.loads(pickle.dumps(record)), copy.deepcopy(record)):
            assert type(again) is type(record)
            assert again.counts == record.counts
    visible = np.ones(3, dtype=bool)
    VisibilityStage(visible=visible)
    visible[0] = False


@pytest.mark.parametrize("through", [lambda r: pickle.loads(pickle.dumps(r)), copy.deepcopy])
def test_a_relief_survives_pickling_and_copying(through):
    mesh = to_mesh(bust())
    mesh.paint_uniform_color((0.2, 0.4, 0.6))
    relief = rel.make_relief(mesh, rel.ReliefParams(depth="25%", attach=[0]))
    again = through(relief)
    assert "certificate" not in vars(again)  # nobody has asked for it
    for one, other in zip(_snapshot(again.mesh), _snapshot(relief.mesh), strict=True):
        assert np.array_equal(one, other)
    assert np.array_equal(again.mesh.vertex_colors, relief.mesh.vertex_colors)
    assert (again.params, again.view, again.scan) == (relief.params, relief.view, None)
    assert again.report() == relief.report()
    assert list(again.stages) == list(relief.stages)
    for value in (again.to_scene, again.source_index, again.stages["bounded"].z):
        assert not value.flags.writeable
    with pytest.raises(TypeError):
        again.stages["scene"] = None
    assert through(relief).certificate == relief.certificate
    again.mesh.clear()
    assert len(relief.mesh.vertices) > 0


def test_a_relief_of_an_own_class_keeps_it(relief):
    class Own(rel.Relief):
        pass

    own = copy.copy(Own(**{item.name: getattr(relief, item.name) for item in fields(relief)}))
    assert type(own) is Own
    assert own.params == relief.params


def test_short_words_for_long_things(relief):
    assert len(repr(relief)) < 250
    assert all(len(repr(record)) < 400 for record in relief.stages.values())


def test_callback_gets_each_record_as_it_is_done(mesh):
    seen = []
    relief = rel.make_relief(mesh, PARAMS, on_stage=seen.append)
    assert [record.name for record in seen] == STAGES
    assert all(relief.stages[record.name] is record for record in seen)


def test_shapes_and_values_of_the_records(relief):
    s = relief.stages
    n, k = len(s["scene"].vertices), 24
    assert s["scene"].vertices.shape == (n, 3)
    assert s["scene"].faces.max() == n - 1
    assert s["perspective"].vertices.shape == (n, 3)
    assert s["visibility"].visible.dtype == bool
    assert s["clusters"].labels.shape == (n,)
    assert s["clusters"].centers.shape == (k, 2)
    points = s["attenuation"]
    assert set(points.action) <= {"attach", "scale", "discard"}
    assert s["visibility"].visible[points.index].all()
    assert np.array_equal(np.isnan(points.new_height), points.action == "discard")
    assert points.rho.min() == 0
    assert points.rho.max() == 1
    assert np.array_equal(points.beta, np.full(len(points.index), 0.2))
    for name in ("construction", "restoration", "order", "compression"):
        assert s[name].z.shape == (n,)
    error = s["restoration"].order_error
    assert error.min() == 0
    assert error.max() < 1
    assert s["restoration"].solved[error >= 0.2].all()
    assert (s["compression"].alpha == 1).all()


def test_input_is_never_modified(mesh):
    before = _snapshot(mesh)
    rel.make_relief(mesh, PARAMS)
    assert all(np.array_equal(a, b) for a, b in zip(before, _snapshot(mesh), strict=True))


def test_construction_fulfils_equations_6_and_7(relief):
    s = relief.stages
    vertices = s["perspective"].vertices
    laplacian, _ = rel.cotangent_laplacian(vertices, s["scene"].faces)
    points = s["attenuation"]
    z = s["construction"].z
    assert np.array_equal(z[points.kept_index], points.kept_height)
    change = laplacian @ z - laplacian @ vertices[:, 2]
    change[points.kept_index] = 0
    assert np.linalg.norm(change) <= 1e-8 * np.linalg.norm(laplacian @ vertices[:, 2])


def test_relief_stands_on_the_plane_and_is_shallower(relief, mesh):
    z = np.asarray(relief.mesh.vertices)[:, 2]
    assert z.min() == 0.0
    report = relief.report()
    assert report["relief_depth"] == z.max()
    assert report["relief_depth"] < 0.9 * report["scene_visible_depth"]
    assert report["visible_behind_share"] == 0.0
    json.dumps(report)


def test_paper_s_own_rules_leave_some_behind(mesh):
    params = rel.ReliefParams.paper(k=24)
    stages = rel.make_relief(mesh, params).stages
    solved = stages["restoration"].solved
    assert np.array_equal(solved, stages["restoration"].order_error >= 0.2)
    assert stages["restoration"].counts["visible_behind"] > 0
    assert stages["restoration"].counts["set_on_floor"] == 0


@pytest.mark.parametrize("scene", [hills(25), bust(14)])
def test_paper_is_the_published_method(scene):
    stages = rel.make_relief(to_mesh(scene), rel.ReliefParams.paper(k=16)).stages
    shape, points = (stages["scene"].vertices, stages["scene"].faces), stages["attenuation"]
    built = oracle.construct(shape, points.kept_index, points.kept_height)
    assert stages["construction"].z == pytest.approx(built, abs=1e-6)
    high = stages["restoration"].order_error >= 0.2
    assert high.any()
    restored = oracle.restore(shape, built, high, 0.9)
    assert stages["compression"].z == pytest.approx(restored, abs=1e-6)  # and nothing after it


def test_x_and_y_stay_where_they_are(relief, mesh):
    kept = relief.source_index >= 0
    out = np.asarray(relief.mesh.vertices)[kept]
    back = out @ relief.to_scene[:3, :3].T + relief.to_scene[:3, 3]
    source = np.asarray(mesh.vertices)[relief.source_index[kept]]
    assert back[:, :2] == pytest.approx(source[:, :2], abs=1e-9)


def test_output_is_in_the_input_s_unit(relief):
    small = bust()
    again = rel.make_relief(to_mesh((small[0] * 0.01, small[1])), PARAMS)
    assert np.asarray(again.mesh.vertices) * 100 == pytest.approx(np.asarray(relief.mesh.vertices), abs=1e-6)


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_moved_turned_and_scaled_scene_gives_the_same_relief(relief, scale):
    vertices, faces = bust()
    rotation = turn(11)
    there = scale * (vertices @ rotation.T + [300, -800, 120])
    view = rel.View(front=rotation[:, 2], up=rotation[:, 1])
    again = rel.make_relief(to_mesh((there, faces)), PARAMS, view=view)
    assert np.array_equal(again.source_index, relief.source_index)
    extent = 100 * relief.stages["scene"].unit
    assert np.asarray(again.mesh.vertices) / scale == pytest.approx(
        np.asarray(relief.mesh.vertices), abs=1e-5 * extent
    )
    kept = again.source_index >= 0
    there_x, there_y = (
        (there @ rotation)[again.source_index[kept]][:, axis] for axis in (0, 1)
    )  # both frames have x to the right and y up
    back = np.asarray(again.mesh.vertices)[kept] @ again.to_scene[:3, :3].T + again.to_scene[:3, 3]
    assert (back @ rotation)[:, 0] == pytest.approx(there_x, abs=1e-9 * scale * 1000)
    assert (back @ rotation)[:, 1] == pytest.approx(there_y, abs=1e-9 * scale * 1000)


_HASH = """
import hashlib, sys
sys.path.insert(0, sys.argv[1])
import numpy as np, open3d as o3d, o3d_relief as rel
from shapes import bust, to_mesh
o3d.utility.set_max_threads(int(sys.argv[2]))
mesh = rel.make_relief(to_mesh(bust(72)), rel.ReliefParams(k=24)).mesh
print(hashlib.sha256(np.asarray(mesh.vertices).tobytes() + np.asarray(mesh.triangles).tobytes()).hexdigest())
"""


def test_same_seed_same_bytes_whatever_the_number_of_threads():
    found = set()
    for threads in ("1", "2", "3"):
        names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
        done = subprocess.run(
            [sys.executable, "-c", _HASH, str(Path(__file__).parent), threads],
            env=os.environ | dict.fromkeys(names, threads),
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        found.add(done.stdout)
    assert len(found) == 1


def test_another_seed_gives_another_relief(mesh, relief):
    other = rel.make_relief(mesh, rel.ReliefParams(k=24, seed=1))
    assert np.asarray(other.mesh.vertices).tobytes() != np.asarray(relief.mesh.vertices).tobytes()


def test_exploded_mesh_gives_the_same_surface(relief):
    vertices, faces = exploded(bust())
    again = rel.make_relief(to_mesh((vertices, faces)), PARAMS)
    whole = relief.stages["restoration"].z[bust()[1]].ravel()
    assert again.stages["restoration"].z[again.stages["scene"].welded_index] == pytest.approx(whole, abs=1e-6)
    assert len(again.mesh.triangles) == len(relief.mesh.triangles)


def test_renumbered_mesh_gives_the_same_surface(relief):
    vertices, faces = bust()
    order = np.random.default_rng(2).permutation(len(vertices))
    again = rel.make_relief(to_mesh((vertices[order], np.argsort(order)[faces])), PARAMS)
    assert again.stages["restoration"].z == pytest.approx(relief.stages["restoration"].z[order], abs=1e-6)


def test_more_points_lower_the_relief(mesh):
    depth = [rel.make_relief(mesh, rel.ReliefParams(k=k)).report()["relief_depth"] for k in (1, 8, 64)]
    assert depth[0] > depth[1] > depth[2]


def test_larger_beta_lowers_the_relief(mesh):
    depth = [
        rel.make_relief(mesh, rel.ReliefParams(k=48, beta=b)).report()["relief_depth"]
        for b in (0.02, 0.2, 2.0)
    ]
    assert depth[0] > depth[1] > depth[2]


def test_beta_for_each_point(mesh, relief):
    same = rel.make_relief(mesh, rel.ReliefParams(k=24, beta=[0.2] * 24))
    assert np.array_equal(same.stages["restoration"].z, relief.stages["restoration"].z)
    with pytest.raises(rel.ParameterError, match="one for each of the"):
        rel.make_relief(mesh, rel.ReliefParams(k=24, beta=[0.2] * 7))


def test_one_point_only_shifts_the_scene(mesh):
    relief = rel.make_relief(mesh, rel.ReliefParams(k=1))
    s = relief.stages
    assert s["attenuation"].action.tolist() == ["attach"]
    shift = s["restoration"].z - s["scene"].vertices[:, 2]
    assert np.ptp(shift) < 1e-6


@pytest.mark.parametrize("depth", [3.0, 12.5])
def test_depth_is_exact(mesh, depth):
    relief = rel.make_relief(mesh, rel.ReliefParams(k=24, depth=depth, mode="attenuation"))
    assert np.asarray(relief.mesh.vertices)[:, 2].max() == pytest.approx(depth, rel=1e-9)
    assert relief.stages["compression"].counts["already_shallower"] == 0


def test_shallower_relief_than_asked_for_is_left_alone(mesh, relief):
    again = rel.make_relief(mesh, rel.ReliefParams(k=24, depth=1000, mode="attenuation"))
    assert again.stages["compression"].counts["already_shallower"] == 1
    assert np.array_equal(np.asarray(again.mesh.vertices), np.asarray(relief.mesh.vertices))


def test_alpha_compresses_the_low_more_than_the_high(mesh):
    s = rel.make_relief(mesh, rel.ReliefParams(k=24, alpha=0.8)).stages
    alpha, z = s["compression"].alpha, s["order"].z
    assert alpha[z.argmax()] == 0.8
    assert alpha[z.argmin()] == 0.4
    assert np.array_equal(s["compression"].z, alpha * z)


def test_vanishing_point_narrows_what_lies_behind(mesh):
    far = rel.make_relief(mesh, PARAMS, view=rel.View(vanishing_point=(0, 0, -1e12)))
    near = rel.make_relief(mesh, PARAMS, view=rel.View(vanishing_point=(0, 0, -150)))
    plain = far.stages["scene"].vertices
    assert far.stages["perspective"].vertices == pytest.approx(plain, abs=1e-6)
    width = np.abs(near.stages["perspective"].vertices[:, :2]) / np.maximum(np.abs(plain[:, :2]), 1e-9)
    back = plain[:, 2] < 20
    assert width[back].max() < 0.8
    assert near.stages["perspective"].vertices[plain[:, 2].argmax()] == pytest.approx(
        plain[plain[:, 2].argmax()]
    )


def test_view_from_another_side(mesh):
    vertices, faces = bust()
    tipped = vertices[:, [0, 2, 1]] * [1, -1, 1]  # now -y is the front and z is up
    relief = rel.make_relief(to_mesh((tipped, faces)), PARAMS, view=rel.View(front="-y", up="z"))
    plain = rel.make_relief(mesh, PARAMS)
    assert np.asarray(relief.mesh.vertices) == pytest.approx(np.asarray(plain.mesh.vertices), abs=1e-9)


def test_parts_that_hold_no_point_are_counted_and_moved(mesh):
    ball = moved(sphere(6, radius=2.0), (0, 0, -20))  # hidden inside the body
    relief = rel.make_relief(to_mesh(joined(bust(), ball)), rel.ReliefParams(k=24, in_order=False))
    assert relief.stages["construction"].counts["components"] == 2
    assert relief.stages["construction"].counts["loose_components"] == 1
    tied = rel.make_relief(to_mesh(joined(bust(), ball)), PARAMS)
    assert tied.stages["construction"].counts["loose_components"] == 0
    assert tied.stages["construction"].counts["ties_across_gaps"] > 0


def test_inside_out_parts_are_turned_to_the_viewer(relief):
    vertices, faces = bust()
    mesh = to_mesh((vertices, faces[:, ::-1]))
    mesh.triangle_uvs = o3d.utility.Vector2dVector(vertices[faces[:, ::-1]].reshape(-1, 3)[:, :2])
    again = rel.make_relief(mesh, PARAMS)
    assert again.stages["trim"].counts["faces_turned"] == len(faces)
    assert relief.stages["trim"].counts["faces_turned"] == 0
    normals = []
    for mesh in (relief.mesh, again.mesh):
        a, b, c = np.asarray(mesh.vertices)[np.asarray(mesh.triangles)].transpose(1, 0, 2)
        normals.append(np.cross(b - a, c - a).sum(axis=0))
    assert normals[0] == pytest.approx(normals[1], rel=1e-9, abs=1e-6)
    assert normals[0][2] > 0
    uvs = np.asarray(again.mesh.triangle_uvs)
    xy = (
        np.asarray(again.mesh.vertices)[np.asarray(again.mesh.triangles)].reshape(-1, 3)
        + again.to_scene[:3, 3]
    )
    assert uvs == pytest.approx(xy[:, :2], abs=1e-6)


def _broken(change):
    vertices, faces = hills(9)
    return to_mesh(change(vertices, faces))


def _with_value(value):
    def change(vertices, faces):
        vertices[3, 1] = value
        return vertices, faces

    return change


@pytest.mark.parametrize(
    ("mesh", "words"),
    [
        (o3d.geometry.TriangleMesh(), "empty"),
        (_broken(lambda v, f: (v, np.zeros((0, 3), int))), "no triangles"),
        (_broken(_with_value(np.nan)), "not finite"),
        (_broken(_with_value(np.inf)), "not finite"),
        (_broken(lambda v, f: (v, np.vstack([f, [0, 1, 81]]))), "names vertex 81"),
        (_broken(lambda v, f: (v, np.vstack([f, [0, 1, -1]]))), "names vertex -1"),
        (_broken(lambda v, f: (v * [0, 1, 1], f)), "edge-on"),
        (_broken(lambda v, f: (v, f[:, [0, 0, 1]])), "three different corners"),
        (o3d.geometry.PointCloud(), "no points"),
        (None, "TriangleMesh"),
    ],
)
def test_meshes_that_make_no_relief(mesh, words):
    with pytest.raises(rel.MeshError, match=words):
        rel.make_relief(mesh, rel.ReliefParams(k=4))


@pytest.mark.parametrize("words", [{"params": {"k": 4}}, {"view": (0, 0, 1)}, {"params": rel.View()}])
def test_wrong_kinds_of_arguments(words):
    with pytest.raises(rel.ParameterError, match="must be a"):
        rel.make_relief(to_mesh(hills()), **words)


@pytest.mark.parametrize(
    ("params", "view", "words"),
    [
        ({"k": 1682}, {}, "k must be at most the number of vertices, 1681"),
        ({}, {"viewpoint": (0, 0, 10)}, "viewpoint must lie in front of the scene"),
        ({}, {"viewpoint": (0, 0, 10), "vanishing_point": (0, 0, -9)}, "viewpoint must lie in front"),
    ],
)
def test_parameters_that_do_not_fit_the_scene(params, view, words):
    with pytest.raises(rel.ParameterError, match=words):
        rel.make_relief(to_mesh(hills()), rel.ReliefParams(**params), view=rel.View(**view))


def test_unused_vertices_may_be_anything():
    vertices, faces = hills()
    plain = rel.make_relief(to_mesh((vertices, faces)), PARAMS)
    stray = np.vstack([vertices, [[np.nan, 0, 0], [1e9, 0, 0]]])
    again = rel.make_relief(to_mesh((stray, faces)), PARAMS)
    assert np.array_equal(np.asarray(again.mesh.vertices), np.asarray(plain.mesh.vertices))


def test_flat_plate_is_a_relief_already():
    relief = rel.make_relief(to_mesh(grid(21)), PARAMS)
    assert np.asarray(relief.mesh.vertices)[:, 2].max() == 0.0
    assert len(relief.mesh.triangles) == 800
