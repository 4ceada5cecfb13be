"""GLB through trimesh: one mesh for each material, float32, vertex colours in 8 bits."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from o3d_relief.scene.arrays import WHITE, MeshArrays
from o3d_relief.scene.encode_parts import color_bytes, to_picture, unique_rows

__all__ = ["encode_glb"]


def encode_glb(arrays: MeshArrays) -> bytes:
    """Write a GLB.

    The format stores texture coordinates with the vertex: where the corners of a vertex differ, the
    vertex is written once for each. Without textures the vertices keep their numbers. Faces are sorted by
    material.

    Parameters
    ----------
    arrays : MeshArrays
        At least one face.

    Returns
    -------
    bytes
        The file.

    Examples
    --------
    >>> encode_glb(MeshArrays(vertices=np.eye(3), faces=np.array([[0, 1, 2]])))[:4]
    b'glTF'
    """
    import trimesh
    from trimesh.exchange.gltf import export_glb
    from trimesh.visual import TextureVisuals
    from trimesh.visual.material import PBRMaterial

    scene = trimesh.Scene()
    used = [0] if arrays.material_ids is None else np.unique(arrays.material_ids).tolist()
    for material in used:
        chosen = slice(None) if arrays.material_ids is None else arrays.material_ids == material
        vertex, faces, uvs = _split_corners(arrays, chosen, keep_all=len(used) == 1)
        image = None
        if arrays.textures and not np.array_equal(arrays.textures[material], WHITE):
            image = to_picture(arrays.textures[material])
        visual = TextureVisuals(
            uv=uvs,
            material=PBRMaterial(
                name=f"material_{material}", baseColorTexture=image, metallicFactor=0.0, roughnessFactor=1.0
            ),
        )
        if arrays.colors is not None:
            opaque = np.full((len(vertex), 1), 255, dtype=np.uint8)
            visual.vertex_attributes["color"] = np.hstack([color_bytes(arrays.colors[vertex]), opaque])
        scene.add_geometry(
            trimesh.Trimesh(
                vertices=arrays.vertices[vertex],
                faces=faces,
                vertex_normals=None if arrays.normals is None else arrays.normals[vertex],
                visual=visual,
                process=False,
            ),
            geom_name=f"mesh_{material}",
            node_name=f"node_{material}",
        )
    encoded: bytes = export_glb(scene, include_normals=arrays.normals is not None)
    return encoded


def _split_corners(
    arrays: MeshArrays, chosen: slice | NDArray[np.bool_], *, keep_all: bool
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64] | None]:
    """Give every pair of vertex and texture coordinate that the chosen faces use a vertex of its own.

    Returns the old index of each new vertex (p,), the new faces (q, 3) and the coordinates (p, 2).
    """
    faces = arrays.faces[chosen]
    if arrays.triangle_uvs is None:
        return np.arange(len(arrays.vertices)), faces, None
    uvs, uv_index = unique_rows(arrays.triangle_uvs.reshape(-1, 3, 2)[chosen].reshape(-1, 2))
    keys = faces.ravel() * len(uvs) + uv_index
    unused = np.setdiff1d(np.arange(len(arrays.vertices)), faces) if keep_all else np.zeros(0, dtype=np.int64)
    pairs, corner = np.unique(np.concatenate([keys, unused * len(uvs)]), return_inverse=True)
    return pairs // len(uvs), corner[: len(keys)].reshape(-1, 3), uvs[pairs % len(uvs)]
