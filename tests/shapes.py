"""Shapes made in code, as (vertices, faces)."""

from __future__ import annotations

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

Shape = tuple[NDArray[np.float64], NDArray[np.int64]]


def to_mesh(shape: Shape) -> o3d.geometry.TriangleMesh:
    vertices, faces = shape
    return o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector(vertices), o3d.utility.Vector3iVector(faces.astype(np.int32))
    )


def grid(side: int, *, size: float = 100.0) -> Shape:
    """A flat square at z = 0 of side x side vertices, facing +z, with alternating diagonals."""
    line = np.linspace(-size / 2, size / 2, side)
    x, y = np.meshgrid(line, line, indexing="ij")
    vertices = np.stack([x.ravel(), y.ravel(), np.zeros(side * side)], axis=1)
    number = np.arange(side * side).reshape(side, side)
    a, b = number[:-1, :-1].ravel(), number[1:, :-1].ravel()
    c, d = number[1:, 1:].ravel(), number[:-1, 1:].ravel()
    odd = ((a // side + a) % 2).astype(bool)[:, None]
    first = np.where(odd, np.stack([a, b, d], 1), np.stack([a, b, c], 1))
    second = np.where(odd, np.stack([b, c, d], 1), np.stack([a, c, d], 1))
    return vertices, np.concatenate([first, second])


def hills(side: int = 41) -> Shape:
    """One open, smooth surface with several hills and hollows, about 40 high over 100 wide."""
    vertices, faces = grid(side)
    x, y = vertices[:, 0] / 50.0, vertices[:, 1] / 50.0
    z = 14 * np.sin(3.1 * x + 0.4) * np.cos(2.3 * y) + 9 * np.cos(4.7 * x * y + 1) + 6 * x - 4 * y**2
    vertices[:, 2] = z
    return vertices, faces


def sphere(resolution: int = 24, radius: float = 50.0) -> Shape:
    mesh = o3d.geometry.TriangleMesh.create_sphere(radius, resolution)
    return np.array(mesh.vertices), np.array(mesh.triangles, dtype=np.int64)


def bust(resolution: int = 40) -> Shape:
    """A closed, bumpy body with a hidden back and a nose that overhangs: one component."""
    vertices, faces = sphere(resolution)
    x, y, z = (vertices / 50.0).T
    bumps = 1 + 0.12 * np.sin(5 * x + 1) * np.cos(6 * y) + 0.08 * np.sin(9 * z + 2 * y)
    nose = 0.4 * np.exp(-((x - 0.1) ** 2 + (y + 0.1) ** 2) / 0.05) * (z > 0)
    vertices = vertices * (bumps + nose)[:, None]
    vertices[:, 1] += 12 * np.exp(-((x - 0.1) ** 2 + (y + 0.1) ** 2) / 0.08) * (z > 0)
    return vertices, faces


def joined(*shapes: Shape) -> Shape:
    vertices = np.concatenate([v for v, _ in shapes])
    starts = np.cumsum([0] + [len(v) for v, _ in shapes[:-1]])
    return vertices, np.concatenate([f + start for (_, f), start in zip(shapes, starts, strict=True)])


def moved(shape: Shape, offset: tuple[float, float, float]) -> Shape:
    return shape[0] + np.asarray(offset), shape[1]


def exploded(shape: Shape) -> Shape:
    """Every face with three vertices of its own, as in an STL file."""
    vertices, faces = shape
    return vertices[faces].reshape(-1, 3), np.arange(3 * len(faces)).reshape(-1, 3)


def turn(seed: int) -> NDArray[np.float64]:
    """A random rotation matrix."""
    q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return q * np.sign(np.linalg.det(q))
