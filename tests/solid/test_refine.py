from dataclasses import replace

import numpy as np
import pytest
import trimesh

from o3d_relief.scene.arrays import MeshArrays
from o3d_relief.solid.refine import refined_for_texture
from o3d_relief.solid.texture_ranges import Ranges
from shapes import bust, exploded, grid

NOISE = np.random.default_rng(0).integers(0, 255, (64, 64, 3)).astype(np.uint8)
FLAT = np.full((64, 64, 3), 90, dtype=np.uint8)


def textured(vertices, faces, texture=NOISE):
    """Texture coordinates that are x and y, so that they can be checked anywhere."""
    return MeshArrays(
        vertices=vertices,
        faces=faces,
        colors=(vertices - vertices.min()) / np.ptp(vertices),
        triangle_uvs=vertices[faces].reshape(-1, 3)[:, :2] * 0.1,
        material_ids=np.arange(len(faces)) % 3,
        textures=(texture,) * 3,
    )


def test_no_edge_is_longer_and_the_surface_is_the_same():
    mesh = textured(*bust(12))
    fine = refined_for_texture(mesh, 3.0)
    before, after = (trimesh.Trimesh(m.vertices, m.faces, process=False) for m in (mesh, fine))
    seen = after.face_normals[:, 2] > -0.4
    assert after.edges_unique_length[after.faces_unique_edges[seen]].max() <= 3.0
    assert before.edges_unique_length.max() > 3.0
    assert after.is_watertight
    assert after.is_winding_consistent
    assert after.volume == pytest.approx(before.volume, rel=1e-12)
    assert after.area == pytest.approx(before.area, rel=1e-12)
    np.testing.assert_array_equal(fine.vertices[: len(mesh.vertices)], mesh.vertices)


def test_texture_colours_and_materials_follow():
    mesh = textured(*bust(12))
    fine = refined_for_texture(mesh, 3.0)
    np.testing.assert_allclose(fine.triangle_uvs, fine.vertices[fine.faces].reshape(-1, 3)[:, :2] * 0.1)
    np.testing.assert_allclose(fine.colors, (fine.vertices - mesh.vertices.min()) / np.ptp(mesh.vertices))
    area = [
        np.bincount(m.material_ids, trimesh.Trimesh(m.vertices, m.faces, process=False).area_faces)
        for m in (mesh, fine)
    ]
    np.testing.assert_allclose(area[1], area[0])


def test_the_back_stays_as_it_is():
    vertices, faces = grid(5)
    assert len(refined_for_texture(textured(vertices, faces), 10.0).faces) > len(faces)
    away = textured(vertices, faces[:, ::-1])
    assert refined_for_texture(away, 10.0) is away


def test_faces_with_vertices_of_their_own_still_meet():
    fine = refined_for_texture(textured(*exploded(bust(12))), 3.0)
    welded = trimesh.Trimesh(fine.vertices, fine.faces, process=True)
    assert welded.is_watertight


def test_refinement_ends():
    mesh = textured(*bust(6))
    assert 150_000 <= len(refined_for_texture(mesh, 1e-6).faces) < 1_000_000


def test_faces_of_one_colour_stay_large():
    mesh = textured(*bust(12), texture=FLAT)
    assert refined_for_texture(mesh, 3.0) is mesh


def test_only_where_the_texture_changes_are_faces_split():
    spot = FLAT.copy()
    spot[20:24, 20:24] = 255
    vertices, faces = grid(9)
    mesh = replace(
        textured(vertices, faces, texture=spot),
        triangle_uvs=(vertices[faces][..., :2] / 100 + 0.5).reshape(-1, 2),
    )
    fine = refined_for_texture(mesh, 2.0)
    edges = trimesh.Trimesh(fine.vertices, fine.faces, process=False).edges_unique_length
    assert edges.min() < 2.0
    assert edges.max() > 12.0
    corners = fine.vertices[fine.faces]
    center = corners.mean(axis=1)[:, :2] / 100 + 0.5
    size = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    at_spot = (np.abs(center - 22 / 64) < 2.5 / 64).all(axis=1)
    away = (np.abs(center - 22 / 64) > 0.2).any(axis=1)
    assert size[at_spot].max() < 2.5  # within the spot all is one colour
    assert size[away].min() > 6.0
    assert len(fine.faces) < 2000
    solid = trimesh.Trimesh(fine.vertices, fine.faces, process=False)
    assert solid.area == pytest.approx(10_000.0)


def test_ranges_are_never_too_small():
    rng = np.random.default_rng(1)
    texture = rng.integers(0, 255, (37, 50, 3)).astype(np.uint8)
    texture[:20] //= 8
    first = rng.integers(0, [50, 37], (200, 2))
    last = np.minimum(first + rng.integers(0, 12, (200, 2)), [49, 36])
    low, high = (first + 0.1) / [50, 37], (last + 0.9) / [50, 37]
    found = Ranges(texture).within(low, high)
    for (i0, j0), (i1, j1), value in zip(first, last, found, strict=True):
        part = texture[max(j0 - 1, 0) : j1 + 2, max(i0 - 1, 0) : i1 + 2].astype(int).reshape(-1, 3)
        assert value >= np.ptp(part, axis=0).max()
    np.testing.assert_array_equal(Ranges(texture).within(low + 3.0, high + 3.0), found)


def test_meshes_without_textures_stay_as_they_are():
    vertices, faces = bust(12)
    plain = MeshArrays(vertices=vertices, faces=faces, colors=np.ones_like(vertices))
    assert refined_for_texture(plain, 1.0) is plain


def test_ranges_of_small_rectangles_are_exact():
    texture = np.zeros((9, 12, 3), dtype=np.uint8)
    texture[4, 5] = (10, 200, 30)
    corner = np.array([[4.2 / 12, 3.2 / 9], [0.1 / 12, 0.1 / 9], [6.5 / 12, 5.5 / 9], [8.5 / 12, 5.5 / 9]])
    assert Ranges(texture).within(corner, corner + 0.01).tolist() == [200, 0, 200, 0]
