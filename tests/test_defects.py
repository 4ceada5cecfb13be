"""Meshes with the defects of real files: the relief is that of the sound mesh, or a sentence says why not."""

import numpy as np
import open3d as o3d
import pytest

import o3d_relief as rel
from shapes import bust, exploded, grid, hills, joined, moved, sphere, to_mesh

PARAMS = rel.ReliefParams(k=16, in_order=False)
SHAPE = bust(24)
EXTENT = float(np.ptp(SHAPE[0], axis=0).max())


@pytest.fixture(scope="module")
def sound():
    return rel.make_relief(to_mesh(SHAPE), PARAMS)


def made(vertices, faces, params=PARAMS, **options):
    relief = rel.make_relief(to_mesh((vertices, faces)), params, **options)
    assert np.isfinite(np.asarray(relief.mesh.vertices)).all()
    assert np.isfinite(np.asarray(relief.mesh.vertex_normals)).all()
    return relief


def heights(relief, n):
    """Return the relief height of each input vertex, NaN where it was cut off."""
    z = np.full(n, np.nan)
    kept = relief.source_index >= 0
    z[relief.source_index[kept]] = np.asarray(relief.mesh.vertices)[kept, 2]
    return z


def assert_same(relief, sound, index, tolerance=1e-6 * EXTENT):
    """Check that input vertex i of the relief has the height of vertex index[i] of the sound one."""
    index = np.asarray(index)
    found, wanted = heights(relief, len(index)), heights(sound, len(SHAPE[0]))[index]
    both = np.isfinite(found) & np.isfinite(wanted)
    assert both.sum() > 0.4 * len(index)
    assert (np.isfinite(found) ^ np.isfinite(wanted)).sum() <= 0.01 * len(index)
    np.testing.assert_allclose(found[both], wanted[both], atol=tolerance)


def facing(relief):
    """Return the share of the area of a relief, as seen from the front, that faces the viewer."""
    a, b, c = np.asarray(relief.mesh.vertices)[np.asarray(relief.mesh.triangles)].transpose(1, 0, 2)
    area = np.cross(b - a, c - a)[:, 2]
    return area[area > 0].sum() / np.abs(area).sum()


class TestSeams:
    def test_soup(self, sound):
        soup = exploded(SHAPE)
        assert_same(made(*soup), sound, SHAPE[1].ravel())

    @pytest.mark.parametrize("noise", [1e-9, 1e-7, 1e-6])
    def test_seams_that_differ_by_rounding(self, sound, noise):
        vertices, faces = exploded(SHAPE)
        shaken = vertices + noise * EXTENT * np.random.default_rng(1).uniform(-1, 1, vertices.shape)
        relief = made(shaken, faces)
        assert relief.stages["construction"].counts["components"] == 1
        assert len(relief.stages["scene"].vertices) == len(sound.stages["scene"].vertices)
        # Points that were equally good may be chosen differently: the relief as a whole is the same.
        found, wanted = heights(relief, len(vertices)), heights(sound, len(SHAPE[0]))[SHAPE[1].ravel()]
        assert np.nanmedian(np.abs(found - wanted)) <= 0.05 * EXTENT
        assert np.asarray(relief.mesh.vertices)[:, 2].max() == pytest.approx(np.nanmax(wanted), rel=0.06)

    def test_single_precision(self, sound):
        vertices, faces = exploded(SHAPE)
        far = vertices + np.array([800.0, -300.0, 40.0])  # eight extents away, rounded to float32
        relief = made(far.astype(np.float32).astype(float), faces)
        assert relief.stages["construction"].counts["components"] == 1

    def test_normals_run_across_a_rounded_seam(self):
        vertices, faces = exploded(sphere(16))
        shaken = vertices + 1e-6 * np.random.default_rng(2).uniform(-1, 1, vertices.shape)
        relief = made(shaken, faces)
        own = relief.source_index >= 0
        place = sphere(16)[1].ravel()[relief.source_index[own]]
        normals = np.asarray(relief.mesh.vertex_normals)[own]
        low, high = np.full((place.max() + 1, 3), np.inf), np.full((place.max() + 1, 3), -np.inf)
        np.minimum.at(low, place, normals)
        np.maximum.at(high, place, normals)
        apart = (high - low).max(axis=1)[np.unique(place)]
        assert (apart < 1e-9).mean() > 0.9  # all but the creases that the relief itself has

    def test_close_layers_stay_apart(self):
        lower, upper = grid(9), moved(hills(9), (0, 0, 60))
        near = (upper[0] + [0, 0, 2e-4], upper[1])
        relief = made(*joined(lower, upper, near))
        assert relief.stages["construction"].counts["components"] >= 2


class TestFaces:
    def test_duplicate_and_doubled(self, sound):
        vertices, faces = SHAPE
        relief = made(vertices, np.concatenate([faces, faces[::2], faces[:, ::-1]]))
        assert relief.stages["scene"].counts["duplicate_faces"] == len(faces) + len(faces[::2])
        assert_same(relief, sound, np.arange(len(vertices)))

    def test_fins_make_edges_of_three_faces(self, sound):
        vertices, faces = SHAPE
        tips = vertices[faces[:5, 0]] * 1.05
        fins = np.column_stack([faces[:5, :2], len(vertices) + np.arange(5)])
        relief = made(np.vstack([vertices, tips]), np.vstack([faces, fins]))
        found, wanted = heights(relief, len(vertices) + 5)[: len(vertices)], heights(sound, len(vertices))
        assert np.nanmedian(np.abs(found - wanted)) < 0.05 * EXTENT

    @pytest.mark.parametrize("share", [0.2, 0.5, 1.0])
    def test_flipped_faces_are_turned(self, sound, share):
        vertices, faces = SHAPE
        turned = np.random.default_rng(3).random(len(faces)) < share
        relief = made(vertices, np.where(turned[:, None], faces[:, ::-1], faces))
        assert_same(relief, sound, np.arange(len(vertices)))
        assert facing(relief) == pytest.approx(facing(sound), abs=1e-9)
        normals, index = np.asarray(relief.mesh.vertex_normals), relief.source_index
        inner = (index >= 0) & (np.asarray(relief.mesh.vertices)[:, 2] > 20)  # far from the cut
        assert np.array_equal(index[inner], sound.source_index[inner])
        np.testing.assert_allclose(normals[inner], np.asarray(sound.mesh.vertex_normals)[inner], atol=1e-9)

    def test_holes(self, sound):
        vertices, faces = SHAPE
        holes = np.linalg.norm(vertices[faces].mean(axis=1) - [10, 20, 45], axis=1) < 12
        assert holes.any()
        relief = made(vertices, faces[~holes])
        assert relief.stages["construction"].counts["components"] == 1
        depth, wanted = (np.asarray(mesh.vertices)[:, 2].max() for mesh in (relief.mesh, sound.mesh))
        assert depth == pytest.approx(
            wanted, rel=0.3
        )  # the back of the hole is seen now, and brought forward

    def test_slivers_and_triangles_without_area(self, sound):
        vertices, faces = SHAPE
        a, b = vertices[faces[7, :2]]
        n = len(vertices)
        more = np.vstack([vertices, (a + b) / 2, a + 0.3 * (b - a) + 1e-9, a])
        thin = [[faces[7, 0], faces[7, 1], n], [faces[7, 0], faces[7, 1], n + 1], [faces[7, 0], n + 2, n]]
        relief = made(more, np.vstack([faces, thin, [[3, 3, 5]], [[4, 4, 4]]]))
        counts = relief.stages["scene"].counts
        assert counts["degenerate_faces"] >= 3
        assert_same(relief, sound, np.append(np.arange(n), faces[7, [0, 0, 0]]), tolerance=0.05 * EXTENT)

    def test_unreferenced_vertices_may_be_anything(self, sound):
        vertices, faces = SHAPE
        stray = np.array([[np.nan, 0, 0], [np.inf, -np.inf, 1e300], [1e9, 0, -1e9]])
        relief = made(np.vstack([stray, vertices]), faces + 3)
        assert relief.stages["scene"].counts["unreferenced_vertices"] == 3
        np.testing.assert_allclose(
            np.asarray(relief.mesh.vertices), np.asarray(sound.mesh.vertices), atol=1e-9 * EXTENT
        )

    def test_pieces_of_three_vertices(self, sound):
        pieces = np.random.default_rng(4).uniform(-40, 40, (30, 3, 3)) * 0.02
        pieces = pieces + np.random.default_rng(5).uniform(-40, 40, (30, 1, 3))
        debris = (pieces.reshape(-1, 3), np.arange(90).reshape(-1, 3))
        relief = made(*joined(SHAPE, debris))
        assert relief.stages["construction"].counts["components"] > 20
        found = heights(relief, len(SHAPE[0]) + 90)[: len(SHAPE[0])]
        assert np.isfinite(found).sum() > 0.4 * len(found)


class TestSizes:
    @pytest.mark.parametrize("offset", [(5e5, 5e6, 300.0), (-5e6, 5e5, 1e4)])
    def test_far_away(self, sound, offset):
        relief = made(*moved(SHAPE, offset))
        np.testing.assert_allclose(
            np.asarray(relief.mesh.vertices), np.asarray(sound.mesh.vertices), atol=2e-7 * EXTENT
        )
        back = np.asarray(relief.mesh.vertices) @ relief.to_scene[:3, :3].T + relief.to_scene[:3, 3]
        own = relief.source_index >= 0
        wanted = SHAPE[0][relief.source_index[own]] + offset
        np.testing.assert_allclose(back[own, :2], wanted[:, :2], atol=1e-8)

    @pytest.mark.parametrize("scale", [1e-40, 1e-6, 1e6, 1e40])
    def test_tiny_and_huge(self, sound, scale):
        relief = made(SHAPE[0] * scale, SHAPE[1])
        wanted = np.asarray(sound.mesh.vertices)
        np.testing.assert_allclose(np.asarray(relief.mesh.vertices) / scale, wanted, atol=1e-7 * EXTENT)
        np.testing.assert_allclose(
            np.asarray(relief.mesh.vertex_normals), np.asarray(sound.mesh.vertex_normals), atol=1e-6
        )

    @pytest.mark.parametrize(
        ("scale", "sentence"), [(1e60, "scale it down first"), (1e-60, "scale it up first")]
    )
    def test_beyond_what_can_be_computed(self, scale, sentence):
        with pytest.raises(rel.MeshError, match=sentence):
            made(SHAPE[0] * scale, SHAPE[1])


class TestRefusals:
    """None of these may end the process; the fuzz tests look for more of them in processes of their own."""

    @pytest.mark.parametrize(
        ("vertices", "faces", "sentence"),
        [
            (np.zeros((0, 3)), np.zeros((0, 3), int), "it has no vertices"),
            (np.eye(3), np.zeros((0, 3), int), "no triangles, only 3 vertices"),
            (np.eye(3), np.array([[0, 1, 3]]), "names vertex 3, but the mesh has the vertices 0 to 2"),
            (np.eye(3), np.array([[0, 1, -1]]), "names vertex -1"),
            (np.diag([1, np.nan, 1]), np.array([[0, 1, 2]]), "not finite numbers, in 1 of its 1"),
            (np.diag([1, np.inf, 1]), np.array([[0, 1, 2]]), "not finite numbers, in 1 of its 1"),
            (np.zeros((3, 3)), np.array([[0, 1, 2]]), "seen edge-on"),
            (grid(4)[0][:, [2, 1, 0]], grid(4)[1], "seen edge-on"),
            (grid(4)[0], grid(4)[1][:, [0, 0, 1]], "three different corners"),
        ],
    )
    def test_one_sentence(self, vertices, faces, sentence):
        with pytest.raises(rel.MeshError, match=sentence):
            made(vertices, faces, rel.ReliefParams(k=1))

    def test_vanishing_point_that_leaves_nothing(self):
        view = rel.View(viewpoint=(0, 0, 1e12), vanishing_point=(0, 0, -0.02))
        with pytest.raises(rel.ParameterError, match="vanishing_point must leave the scene its shape"):
            made(*grid(5), rel.ReliefParams(k=1), view=view)

    def test_more_triangles_than_accepted(self):
        with pytest.raises(rel.MeshError, match=r"32 triangles, more than the 31 that are accepted"):
            made(*grid(5), rel.ReliefParams(k=1), max_triangles=31)
        made(*grid(5), rel.ReliefParams(k=1), max_triangles=32)


class TestSmallest:
    def test_one_triangle(self):
        relief = made(
            np.array([[0, 0, 0], [4, 0, 1], [0, 3, 2.0]]), np.array([[0, 1, 2]]), rel.ReliefParams(k=1)
        )
        assert len(relief.mesh.triangles) == 1
        assert relief.certificate.failures == []

    def test_flat(self):
        relief = made(*grid(6), rel.ReliefParams(k=4))
        assert np.asarray(relief.mesh.vertices)[:, 2].max() == 0.0


class TestAttributes:
    def test_lengths_that_do_not_fit_are_left_out(self):
        mesh = to_mesh(grid(4))
        mesh.vertex_colors = o3d.utility.Vector3dVector(np.ones((5, 3)))
        mesh.vertex_normals = o3d.utility.Vector3dVector(np.ones((17, 3)))
        mesh.triangle_uvs = o3d.utility.Vector2dVector(np.ones((7, 2)))
        mesh.triangle_material_ids = o3d.utility.IntVector([0, 9, -4])
        mesh.textures = [o3d.geometry.Image(np.zeros((2, 2, 3), np.uint8)), o3d.geometry.Image()]
        relief = rel.make_relief(mesh, rel.ReliefParams(k=1))
        assert not relief.mesh.has_vertex_colors()
        assert not relief.mesh.has_triangle_uvs()
        assert not relief.mesh.has_triangle_material_ids()

    def test_material_ids_out_of_range_are_white(self, tmp_path):
        mesh = to_mesh(grid(3))
        mesh.triangle_uvs = o3d.utility.Vector2dVector(np.full((24, 2), 0.5))
        mesh.triangle_material_ids = o3d.utility.IntVector([0, 9, -4, 0, 0, 0, 0, 0])
        mesh.textures = [o3d.geometry.Image(np.full((2, 2, 3), 7, np.uint8))]
        relief = rel.make_relief(mesh, rel.ReliefParams(k=1))
        rel.write_mesh(tmp_path / "a.obj", relief.mesh)
        back = rel.read_mesh(tmp_path / "a.obj")
        colors = [int(np.asarray(back.textures[i])[0, 0, 0]) for i in back.triangle_material_ids]
        assert colors == [7, 255, 255, 7, 7, 7, 7, 7]

    def test_values_that_are_no_numbers_are_replaced_and_counted(self):
        mesh = to_mesh(grid(3))
        colors, uvs = np.full((9, 3), 0.2), np.full((24, 2), 0.3)
        colors[4], uvs[6, 1], uvs[7, 0] = np.nan, np.inf, -1e300
        mesh.vertex_colors = o3d.utility.Vector3dVector(colors)
        mesh.triangle_uvs = o3d.utility.Vector2dVector(uvs)
        relief = rel.make_relief(mesh, rel.ReliefParams(k=1))
        assert relief.stages["trim"].counts["attributes_mended"] == 3
        assert np.array_equal(np.asarray(relief.mesh.vertex_colors)[4], [1, 1, 1])
        assert np.array_equal(np.asarray(relief.mesh.triangle_uvs)[6:8], np.full((2, 2), 0.5))
