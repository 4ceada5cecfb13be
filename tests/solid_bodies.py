"""Shapes in front of z = 0, in the relief frame, for the tests of solids."""

import numpy as np
import trimesh

from o3d_relief.scene.arrays import MeshArrays
from o3d_relief.stages.trim import trim_behind


def cut(mesh):
    """Cut a trimesh at z = 0, as a relief is."""
    vertices = np.array(mesh.vertices, dtype=np.float64)
    trimmed = trim_behind(vertices, np.array(mesh.faces), np.ones(len(vertices), dtype=bool))
    return arrays(trimmed.vertices, trimmed.faces)


def arrays(vertices, faces):
    return MeshArrays(vertices=np.asarray(vertices, dtype=np.float64), faces=np.asarray(faces))


def ball(center=(0, 0, 0), radius=30.0, detail=3):
    mesh = trimesh.creation.icosphere(detail, radius)
    # Off the symmetric places, so that no vertex lies in the cut.
    mesh.apply_transform(trimesh.transformations.rotation_matrix(0.3, [1, 2, 3]))
    mesh.apply_translation(center)
    return mesh


def ring(center=(0, 0, 0), turn=90.0):
    """A torus; turned by 90 degrees it stands upright on z = 0."""
    mesh = trimesh.creation.torus(20.0, 5.0, major_sections=48, minor_sections=24)
    mesh.apply_transform(trimesh.transformations.rotation_matrix(np.radians(turn), [1, 0, 0]))
    mesh.apply_translation(center)
    return mesh


def together(*meshes):
    return trimesh.util.concatenate([*meshes])


def sheet(height, size=40.0, count=12):
    """A height field over a square, its faces turned to the viewer."""
    steps = np.linspace(-size / 2, size / 2, count)
    x, y = (values.ravel() for values in np.meshgrid(steps, steps))
    corner = (np.arange(count - 1)[:, None] * count + np.arange(count - 1)).ravel()
    right, up = corner + 1, corner + count
    faces = np.concatenate([np.stack([corner, right, up], 1), np.stack([right, up + 1, up], 1)])
    return np.stack([x, y, height(x, y)], axis=1), faces


def under(mesh):
    """Volume between a surface and z = 0, counted with its sign: the flux of (0, 0, z)."""
    a, b, c = mesh.vertices[mesh.faces].transpose(1, 0, 2)
    upward = np.cross(b - a, c - a)[:, 2] / 2.0
    return float((upward * (a + b + c)[:, 2] / 3.0).sum())
