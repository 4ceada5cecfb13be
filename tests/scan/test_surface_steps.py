"""From oriented normals to a mesh: where the surface lies, what is cut away, which parts stay."""

import dataclasses

import numpy as np
import pytest
from scipy.spatial import cKDTree

from o3d_relief.errors import MeshError
from o3d_relief.params import View
from o3d_relief.scan.steps import points_step
from o3d_relief.scan.surface_steps import parts_step, skin_step, surface_step
from o3d_relief.scan_params import ScanParams
from o3d_relief.scan_records import OrientationStage, SkinStage
from o3d_relief.scene.arrays import CloudArrays
from shapes import grid, joined, moved

CENTRE, RADIUS, COUNT = np.array([1000.0, -20.0, 5.0]), 50.0, 3000
PARAMS = ScanParams(depth=5)


def dome():
    """Directions to points spread evenly over the upper half of a ball."""
    z = (np.arange(COUNT) + 0.5) / COUNT
    angle = np.arange(COUNT) * np.pi * (3.0 - np.sqrt(5.0))
    level = np.sqrt(1.0 - z**2)
    return np.column_stack([level * np.cos(angle), level * np.sin(angle), z])


@pytest.fixture(scope="module")
def scan():
    """Half a ball, and a sheet below it that is marked as not to be used."""
    outwards = dome()
    unused, _ = moved(grid(8, size=60.0), tuple(CENTRE - (0.0, 0.0, 40.0)))
    colors = np.where(outwards[:, :1] < 0.0, (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    cloud = CloudArrays(
        points=np.concatenate([CENTRE + RADIUS * outwards, unused]),
        colors=np.concatenate([colors, np.full((len(unused), 3), 0.5)]),
    )
    points, work = points_step(cloud, PARAMS, View())
    normals = np.concatenate([outwards, np.zeros((len(unused), 3))])
    return points, work, OrientationStage(normals=normals, method="sensor")


@pytest.fixture(scope="module")
def surface(scan):
    _, work, oriented = scan
    return surface_step(work, oriented, PARAMS)


def off_the_ball(vertices):
    return np.abs(np.linalg.norm(vertices - CENTRE, axis=1) - RADIUS)


def border(faces):
    """Return the edges that one face alone has."""
    edges = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    edges, count = np.unique(edges, axis=0, return_counts=True)
    return edges[count == 1]


def test_the_surface_goes_through_the_points_in_the_cloud_s_own_frame(scan, surface):
    points, _, _ = scan
    near, _ = cKDTree(surface.vertices).query(points.points[:COUNT])
    assert near.max() < 2.0 * points.spacing
    upper = surface.vertices[:, 2] > CENTRE[2] + 2.0 * points.spacing
    assert off_the_ball(surface.vertices[upper]).max() < 0.25 * points.spacing
    a, b, c = surface.vertices[surface.faces].transpose(1, 0, 2)
    outwards = np.einsum("fj,fj->f", np.cross(b - a, c - a), (a + b + c) / 3.0 - CENTRE)
    assert (outwards[upper[surface.faces].all(axis=1)] > 0.0).all()
    assert len(surface.density) == len(surface.vertices)


def test_points_without_a_normal_hold_no_surface(scan, surface):
    points, work, oriented = scan

    def median_distance(vertices):
        return np.median(cKDTree(vertices).query(points.points[COUNT:])[0])

    assert median_distance(surface.vertices) > 20.0
    normals = oriented.normals.copy()
    normals[COUNT:] = (0.0, 0.0, -1.0)
    used = OrientationStage(normals=normals, method="sensor")
    assert median_distance(surface_step(work, used, PARAMS).vertices) < 2.0


def test_the_depth_is_the_one_asked_for_or_follows_the_spacing(scan, surface):
    points, work, oriented = scan
    assert surface.depth == surface.counts["depth"] == 5
    found = surface_step(work, oriented, ScanParams())
    cell = 1.1 * 2.0 * RADIUS / 2.0**found.depth
    assert 0.5 < cell / points.spacing < 2.0
    finer = surface_step(work, oriented, ScanParams(depth=6))
    assert finer.depth == 6
    assert len(finer.faces) > 3 * len(surface.faces)


def test_the_skin_is_open_where_no_points_are(scan, surface):
    points, work, oriented = scan
    skin = skin_step(work, oriented, surface, PARAMS)
    edges = border(skin.faces)
    assert len(edges) > 0
    rim = skin.vertices[np.unique(edges)]
    assert np.abs(rim[:, 2] - CENTRE[2]).max() < 3.0 * points.spacing  # at the dome's foot, not elsewhere
    a, b, c = skin.vertices[skin.faces].transpose(1, 0, 2)
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()
    assert area == pytest.approx(2.0 * np.pi * RADIUS**2, rel=0.06)
    assert skin.counts["faces"] == len(skin.faces) < len(surface.faces)
    assert skin.distance.shape == (len(surface.vertices),)
    assert np.median(skin.distance[surface.vertices[:, 2] > CENTRE[2]]) < 1.0


def test_a_surface_far_from_all_points_is_refused(scan, surface):
    _, work, oriented = scan
    far = dataclasses.replace(surface, vertices=surface.vertices + 500.0)
    with pytest.raises(MeshError, match="Nothing of the surface lies near the points"):
        skin_step(work, oriented, far, PARAMS)


def plates():
    """A large and a small plate beside it on the dome's left, and a vertex that no face uses."""
    vertices, faces = joined(
        moved(grid(5, size=10.0), (-30.0, 0.0, 40.0)), moved(grid(3, size=2.0), (30.0, 0.0, 40.0))
    )
    vertices = np.concatenate([[[0.0, 0.0, 0.0]], vertices]) + CENTRE
    return SkinStage(distance=np.zeros(len(vertices)), vertices=vertices, faces=faces + 1)


@pytest.mark.parametrize(("least", "parts", "vertices"), [(0.01, 2, 34), (0.2, 1, 25)])
def test_parts_are_kept_by_their_share(scan, least, parts, vertices):
    points, _, oriented = scan
    kept = parts_step(points, oriented, plates(), ScanParams(min_part=least))
    assert kept.counts["parts_dropped"] == 2 - parts
    assert len(kept.vertices) == kept.counts["vertices"] == vertices  # without the one that no face uses
    assert np.array_equal(np.unique(kept.faces), np.arange(vertices))


def test_colors_come_from_the_points_that_are_used(scan):
    points, _, oriented = scan
    kept = parts_step(points, oriented, plates(), ScanParams())
    left = kept.vertices[:, 0] < CENTRE[0]
    assert np.allclose(kept.colors[left], (1.0, 0.0, 0.0))
    assert np.allclose(kept.colors[~left], (0.0, 0.0, 1.0))
    without = parts_step(dataclasses.replace(points, colors=None), oriented, plates(), ScanParams())
    assert without.colors is None
