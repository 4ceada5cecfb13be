"""One colour for each vertex of a mesh, from its colours or its textures."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from o3d_relief.scene.arrays import MeshArrays

__all__ = ["surface_colors"]


def surface_colors(mesh: MeshArrays) -> NDArray[np.float64] | None:
    """Return the colour of each vertex.

    Where there are textures, each vertex takes the mean over its corners of texture times vertex colour.

    Parameters
    ----------
    mesh : MeshArrays

    Returns
    -------
    (n, 3) float64 or None
        sRGB, from 0 to 1; None where the mesh has neither colours nor textures.
    """
    if mesh.triangle_uvs is None or mesh.material_ids is None or not mesh.textures:
        return mesh.colors
    corners = mesh.faces.ravel()
    sampled = np.ones((len(corners), 3))
    material = np.repeat(mesh.material_ids, 3)
    for number, texture in enumerate(mesh.textures):
        mine = material == number
        height, width = texture.shape[:2]
        uv = mesh.triangle_uvs[mine] % 1.0
        column = np.minimum((uv[:, 0] * width).astype(np.int64), width - 1)
        row = np.minimum((uv[:, 1] * height).astype(np.int64), height - 1)
        sampled[mine] = texture[row, column] / 255.0
    count = np.bincount(corners, minlength=len(mesh.vertices))
    mean = (
        np.stack(
            [np.bincount(corners, weights=along, minlength=len(mesh.vertices)) for along in sampled.T], axis=1
        )
        / np.maximum(count, 1)[:, None]
    )
    return mean if mesh.colors is None else np.asarray(mean * mesh.colors)
