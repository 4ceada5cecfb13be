"""Open3D meshes, and records that hold one, pickled and copied as plain arrays: Open3D's own cannot be."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from o3d_relief.frozen import Frozen

__all__ = ["MeshRecord", "PackedMesh"]

_KINDS = {
    "vertices": o3d.utility.Vector3dVector,
    "triangles": o3d.utility.Vector3iVector,
    "vertex_normals": o3d.utility.Vector3dVector,
    "vertex_colors": o3d.utility.Vector3dVector,
    "triangle_normals": o3d.utility.Vector3dVector,
    "triangle_uvs": o3d.utility.Vector2dVector,
    "triangle_material_ids": o3d.utility.IntVector,
}
"""What each attribute is held in."""


@dataclass(frozen=True, kw_only=True, eq=False)
class PackedMesh:
    """All attributes of an Open3D mesh, bit by bit, but for its list of neighbours.

    Attributes
    ----------
    arrays : dict of str to array
        By the names that Open3D gives them; empty ones are left out.
    textures : tuple of array
        As they are; None for an empty picture.
    """

    arrays: dict[str, NDArray[np.generic]]
    textures: tuple[NDArray[np.generic] | None, ...]

    @classmethod
    def of(cls, mesh: o3d.geometry.TriangleMesh) -> PackedMesh:
        """Copy a mesh into arrays.

        Parameters
        ----------
        mesh : open3d.geometry.TriangleMesh
            Never modified.
        """
        arrays = {name: np.array(getattr(mesh, name)) for name in _KINDS}
        return cls(
            arrays={name: array for name, array in arrays.items() if len(array)},
            textures=tuple(None if image.is_empty() else np.array(image) for image in mesh.textures),
        )

    def mesh(self) -> o3d.geometry.TriangleMesh:
        """Return the mesh again.

        Examples
        --------
        >>> len(PackedMesh.of(o3d.geometry.TriangleMesh.create_box()).mesh().triangles)
        12
        """
        result = o3d.geometry.TriangleMesh()
        for name, array in self.arrays.items():
            setattr(result, name, _KINDS[name](array))
        if self.textures:
            result.textures = [
                o3d.geometry.Image() if pixels is None else o3d.geometry.Image(pixels)
                for pixels in self.textures
            ]
        return result


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class MeshRecord(Frozen):
    """Base of records that hold an Open3D mesh, pickled and copied with all that was computed of them.

    Attributes
    ----------
    mesh : open3d.geometry.TriangleMesh
    """

    mesh: o3d.geometry.TriangleMesh

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        _, (kind, values) = super().__reduce__()
        computed = {name: value for name, value in vars(self).items() if name not in values}
        return _made_again, (kind, values | {"mesh": PackedMesh.of(self.mesh)}, computed)


def _made_again(kind: type, values: dict[str, Any], computed: dict[str, Any]) -> object:
    record = kind(**values | {"mesh": values["mesh"].mesh()})
    vars(record).update(computed)
    return record
