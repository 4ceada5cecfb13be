import numpy as np
import open3d as o3d
import pytest

import o3d_relief as rel
from o3d_relief.output import smooth_normals
from o3d_relief.scene.weld import same_places
from shapes import bust, exploded, sphere, to_mesh

PARAMS = rel.ReliefParams(k=24)


def test_attributes_survive_the_weld_and_the_cut():
    vertices, faces = exploded(bust(24))
    mesh = to_mesh((vertices, faces))
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    mesh.vertex_colors = o3d.utility.Vector3dVector((vertices - low) / (high - low))
    mesh.triangle_uvs = o3d.utility.Vector2dVector(
        ((vertices - low) / (high - low))[faces].reshape(-1, 3)[:, :2]
    )
    ids = (np.arange(len(faces)) % 2).astype(np.int32)
    mesh.triangle_material_ids = o3d.utility.IntVector(ids)
    pictures = [np.full((2, 2, 3), value, dtype=np.uint8) for value in (10, 200)]
    mesh.textures = [o3d.geometry.Image(picture) for picture in pictures]
    relief = rel.make_relief(mesh, PARAMS)
    out = relief.mesh
    assert out.has_vertex_normals()
    # Colours and UVs are linear in x and y, so the cut must keep them so.
    xy = np.asarray(out.vertices) @ relief.to_scene[:3, :3].T + relief.to_scene[:3, 3]
    expected = (xy - low) / (high - low)
    assert np.asarray(out.vertex_colors)[:, :2] == pytest.approx(expected[:, :2], abs=1e-6)
    uvs = np.asarray(out.triangle_uvs)
    assert uvs == pytest.approx(expected[np.asarray(out.triangles)].reshape(-1, 3)[:, :2], abs=1e-6)
    assert len(np.asarray(out.triangle_material_ids)) == len(out.triangles)
    # Every output corner lies in a face of its material.
    kept = relief.source_index[np.asarray(out.triangles)]
    source_face = kept.max(axis=1) // 3
    known = source_face >= 0
    assert np.array_equal(np.asarray(out.triangle_material_ids)[known], ids[source_face[known]])
    assert [np.asarray(image).tolist() for image in out.textures] == [p.tolist() for p in pictures]


def test_textures_of_open3d_s_own_reader_survive():
    mesh = to_mesh(bust(24))
    uvs = np.asarray(mesh.vertices)[np.asarray(mesh.triangles)].reshape(-1, 3)[:, :2] / 100 + 0.5
    mesh.triangle_uvs = o3d.utility.Vector2dVector(uvs)
    picture = np.full((4, 4, 3), 90, dtype=np.uint8)
    mesh.textures = [o3d.geometry.Image(), o3d.geometry.Image(picture)]  # the first material has none
    textures = rel.make_relief(mesh, PARAMS).mesh.textures
    assert textures[0].is_empty()
    assert np.array_equal(np.asarray(textures[1]), picture)


def test_normals_do_not_show_the_seams():
    vertices, faces = sphere(40)
    relief = rel.make_relief(to_mesh(exploded((vertices, faces))), PARAMS)
    out, normals = np.asarray(relief.mesh.vertices), np.asarray(relief.mesh.vertex_normals)
    assert np.linalg.norm(normals, axis=1) == pytest.approx(1.0)
    _, place = np.unique(out, axis=0, return_inverse=True)
    inner = out[:, 2] > 5.0
    for axis in range(3):
        spread = np.zeros(place.max() + 1)
        np.maximum.at(spread, place[inner], normals[inner, axis])
        low = np.full(place.max() + 1, np.inf)
        np.minimum.at(low, place[inner], normals[inner, axis])
        used = np.isfinite(low)
        assert (np.maximum(spread, 0) - np.maximum(low, 0))[used].max() < 1e-9


def test_edges_of_a_box_stay_sharp():
    box = o3d.geometry.TriangleMesh.create_box(4, 4, 1)
    corners = exploded((np.asarray(box.vertices), np.asarray(box.triangles, dtype=np.int64)))
    relief = rel.make_relief(to_mesh(corners), rel.ReliefParams.paper(k=1, attach_below=0))
    normals = np.asarray(relief.mesh.vertex_normals)
    assert np.abs(normals).max(axis=1) == pytest.approx(1.0)


def _unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def test_normals_are_means_by_area_over_each_place():
    shape = bust(66)
    vertices, faces = shape
    assert len(faces) > 16384  # more than are worked on at once
    normal = np.cross(
        vertices[faces[:, 1]] - vertices[faces[:, 0]], vertices[faces[:, 2]] - vertices[faces[:, 0]]
    )
    wanted = np.zeros_like(vertices)
    np.add.at(wanted, faces, normal[:, None])
    np.testing.assert_allclose(smooth_normals(vertices, faces), _unit(wanted), atol=1e-12)
    apart, own_faces = exploded(shape)
    first = same_places(apart, own_faces)
    around = np.zeros_like(apart)
    np.add.at(around, first, np.repeat(normal, 3, axis=0))
    np.testing.assert_allclose(smooth_normals(apart, own_faces), _unit(around[first]), atol=1e-12)


@pytest.mark.parametrize(
    ("degrees", "shared"), [(0, True), (30, True), (59, True), (61, False), (120, False)]
)
def test_a_seam_is_smooth_up_to_a_crease(degrees, shared):
    angle = np.deg2rad(degrees)
    wing = [0.0, np.cos(angle), np.sin(angle)]
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, -1, 0], [1, 0, 0], [0, 0, 0], wing])
    normals = smooth_normals(vertices, np.array([[0, 2, 1], [3, 5, 4]]))
    flat, up = np.array([0, 0, 1.0]), np.array([0, -np.sin(angle), np.cos(angle)])
    middle = (flat + up) / np.linalg.norm(flat + up)
    np.testing.assert_allclose(normals[[2, 5]], [flat, up], atol=1e-12)  # at no seam
    np.testing.assert_allclose(normals[[0, 1]], [middle if shared else flat] * 2, atol=1e-12)
    np.testing.assert_allclose(normals[[3, 4]], [middle if shared else up] * 2, atol=1e-12)


def test_what_has_no_area_looks_at_the_viewer():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [5, 5, 5.0]])
    assert smooth_normals(vertices, np.array([[0, 1, 2], [3, 3, 3]])).tolist() == [[0.0, 0.0, 1.0]] * 4


def test_attributes_that_are_not_finite_are_replaced_and_counted():
    mesh = to_mesh(bust(24))
    colors = np.full((len(mesh.vertices), 3), 0.25)
    seen = int(np.argmax(np.asarray(mesh.vertices)[:, 2]))
    colors[seen] = np.nan
    uvs = np.full((3 * len(mesh.triangles), 2), 0.125)
    corner = int(np.flatnonzero(np.asarray(mesh.triangles).ravel() == seen)[0])
    uvs[corner] = [0.125, np.inf]
    mesh.vertex_colors = o3d.utility.Vector3dVector(colors)
    mesh.triangle_uvs = o3d.utility.Vector2dVector(uvs)
    relief = rel.make_relief(mesh, rel.ReliefParams.paper(k=8))
    assert relief.stages["trim"].counts["attributes_mended"] == 2
    out = np.asarray(relief.mesh.vertex_colors)
    np.testing.assert_array_equal(out[relief.source_index == seen], [[1.0, 1.0, 1.0]])
    assert (out[(relief.source_index >= 0) & (relief.source_index != seen)] == 0.25).all()
    mended = np.unique(np.asarray(relief.mesh.triangle_uvs), axis=0).tolist()
    assert [0.5, 0.5] in mended or [0.125, 0.5] in mended
    assert [0.125, 0.125] in mended
