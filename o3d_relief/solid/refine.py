"""Textured meshes refined, so that colours at the vertices can show the texture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from o3d_relief.scene.arrays import MeshArrays
from o3d_relief.scene.weld import first_of_equal_rows
from o3d_relief.solid.halving import halved
from o3d_relief.solid.texture_ranges import Ranges

__all__ = ["refined_for_texture"]

_CONTRAST = 40
"""Levels of 255 by which a texture must change within a face to be worth more vertices."""
_MOST_FACES = 150_000
"""Refinement ends when there are as many faces."""


def refined_for_texture(mesh: MeshArrays, longest: float) -> MeshArrays:
    """Split the faces of a mesh over which a texture changes, until no edge of theirs is too long.

    Faces that clearly look away from the viewer, who stands at +z, are left as they are.
    The surface stays where it is. Edges are halved, on both sides alike, so that faces which met still
    meet; what belongs to vertices and corners is interpolated.

    Parameters
    ----------
    mesh : MeshArrays
    longest : float
        In the mesh's unit. Refinement also ends where there are 150,000 faces.

    Returns
    -------
    MeshArrays
        The same one where it has no textures.

    Examples
    --------
    >>> corner = MeshArrays(
    ...     vertices=np.eye(3),
    ...     faces=np.array([[0, 1, 2]]),
    ...     triangle_uvs=np.array([[0, 0], [1, 0], [0, 1.0]]),
    ...     material_ids=np.array([0]),
    ...     textures=(np.array([[[0] * 3, [255] * 3]], dtype=np.uint8),),
    ... )
    >>> len(refined_for_texture(corner, 1.0).faces)
    4
    """
    if mesh.triangle_uvs is None or mesh.material_ids is None or not mesh.textures:
        return mesh
    ranges = [Ranges(texture) for texture in mesh.textures]
    # The longest edges first, so that what is left over at the end is fine everywhere.
    for target in (8.0 * longest, 4.0 * longest, 2.0 * longest, longest):
        finer: MeshArrays | None = mesh
        while finer is not None and len(finer.faces) < _MOST_FACES:
            mesh = finer
            finer = _halved(mesh, target, _rich(mesh, ranges))
        mesh = mesh if finer is None else finer
    return mesh


def _rich(mesh: MeshArrays, ranges: Sequence[Ranges]) -> NDArray[np.bool_]:
    """Tell over which faces (m,) the texture changes, as far as they can be seen."""
    result = np.zeros(len(mesh.faces), dtype=bool)
    if mesh.triangle_uvs is not None and mesh.material_ids is not None:
        uvs = mesh.triangle_uvs.reshape(-1, 3, 2)
        for material, found in enumerate(ranges):
            mine = mesh.material_ids == material
            result[mine] = found.within(uvs[mine].min(axis=1), uvs[mine].max(axis=1)) > _CONTRAST
    a, b, c = mesh.vertices[mesh.faces].transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    return np.asarray(result & (normal[:, 2] > -0.5 * np.linalg.norm(normal, axis=1)))


def _halved(mesh: MeshArrays, longest: float, rich: NDArray[np.bool_]) -> MeshArrays | None:
    """Halve every edge of a rich face that is longer than `longest`; None where there is none."""
    faces = mesh.faces
    # Edge k runs from corner k to the next one.
    ends = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2)
    length = np.linalg.norm(mesh.vertices[ends[..., 0]] - mesh.vertices[ends[..., 1]], axis=2)
    long = length > longest
    # An edge is halved where a face on either side needs it, also across a seam of the texture.
    place = first_of_equal_rows(mesh.vertices)[ends]
    _, edge = np.unique(place.min(axis=2) * len(mesh.vertices) + place.max(axis=2), return_inverse=True)
    edge = edge.reshape(faces.shape)
    needed = np.zeros(int(edge.max()) + 1, dtype=bool)
    needed[edge[rich[:, None] & long]] = True
    long &= needed[edge]
    if not long.any() or mesh.triangle_uvs is None or mesh.material_ids is None:
        return None
    split = halved(faces, long, len(mesh.vertices))
    first, second = split.pairs.T

    def grown(values: NDArray[np.float64] | None) -> NDArray[np.float64] | None:
        if values is None:
            return None
        return np.concatenate([values, (values[first] + values[second]) / 2.0])

    # Six corners of each face: its own, and the middles of its edges.
    uvs = mesh.triangle_uvs.reshape(-1, 3, 2)
    six_uvs = np.concatenate([uvs, (uvs + np.roll(uvs, -1, axis=1)) / 2.0], axis=1)
    vertices = grown(mesh.vertices)
    return replace(
        mesh,
        vertices=mesh.vertices if vertices is None else vertices,
        faces=split.faces,
        colors=grown(mesh.colors),
        normals=grown(mesh.normals),
        triangle_uvs=six_uvs[split.source[:, None], split.corners].reshape(-1, 2),
        material_ids=mesh.material_ids[split.source],
    )
