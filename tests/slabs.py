"""Solids made in code: plates, with a ball that overhangs."""

from __future__ import annotations

import manifold3d
import numpy as np

from o3d_relief.solid.body import Solid, manifold_of


def plain(part: manifold3d.Manifold, colors=None, *, is_plate: bool = True) -> manifold3d.Manifold:
    mesh = part.to_mesh64()
    vertices, faces = np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts).astype(np.int64)
    return manifold_of(
        vertices, faces, colors=None if colors is None else colors(vertices), is_plate=is_plate
    )


def plate(width: float = 60.0, height: float = 40.0, base: float = 4.0) -> manifold3d.Manifold:
    """A plate whose front is z = 0."""
    return plain(manifold3d.Manifold.cube([width, height, base]).translate([-width / 2, -height / 2, -base]))


def slab(width: float = 60.0, height: float = 40.0, base: float = 4.0) -> Solid:
    return Solid.from_manifold(plate(width, height, base), colored=False)


def ball_on_slab(
    *, colored: bool = False, width: float = 60.0, height: float = 40.0, base: float = 4.0
) -> Solid:
    """A plate with a ball of radius 10 whose centre lies 8 in front of it: it overhangs."""
    ball = plain(
        manifold3d.Manifold.sphere(10.0, 96).translate([3.0, 2.0, 8.0]),
        lambda v: 0.5 + 0.045 * (v - [3.0, 2.0, 8.0]),
        is_plate=False,
    )
    return Solid.from_manifold(plate(width, height, base) + ball, colored=colored)
