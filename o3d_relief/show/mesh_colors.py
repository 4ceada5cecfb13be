"""A mesh's own colours, textures included, as one colour for each vertex."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from o3d_relief.show.colors import to_srgb
from o3d_relief.show.paint import PLASTER, Paint
from o3d_relief.show.surface import read_surface

if TYPE_CHECKING:
    import open3d as o3d

__all__ = ["vertex_colors"]


def vertex_colors(mesh: o3d.geometry.TriangleMesh) -> NDArray[np.float64] | None:
    """Return the colour of each vertex; a texture is read at the corners of the faces around it.

    Parameters
    ----------
    mesh : open3d.geometry.TriangleMesh

    Returns
    -------
    (n, 3) float64 or None
        sRGB in [0, 1], plaster for vertices of no face; None for a mesh without colours.

    Raises
    ------
    MeshError
        No triangle with an area, a vertex that is not finite, or a face index out of range.

    Examples
    --------
    >>> import open3d as o3d
    >>> ball = o3d.geometry.TriangleMesh.create_sphere()
    >>> vertex_colors(ball) is None, vertex_colors(ball.paint_uniform_color((0, 1, 0)))[0].round(6).tolist()
    (True, [0.0, 1.0, 0.0])
    """
    surface = read_surface(mesh, 0.0)
    if surface.vertex_colors is None and surface.corner_uvs is None:
        return None
    count = len(surface.vertices)
    total, number = np.zeros((count, 3)), np.zeros(count)
    for corner in range(3):
        weights = np.zeros((len(surface.faces), 3), dtype=np.float32)
        weights[:, corner] = 1.0
        light = Paint().albedo(surface, np.arange(len(surface.faces)), weights)
        vertex = surface.faces[:, corner]
        number += np.bincount(vertex, minlength=count)
        total += np.column_stack([np.bincount(vertex, light[:, c], minlength=count) for c in range(3)])
    used = number > 0
    mean = to_srgb(total / np.maximum(number, 1)[:, None]).astype(np.float64)
    return np.where(used[:, None], mean, np.array(PLASTER))
