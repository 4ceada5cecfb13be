"""The built-in scene: an octopus that reaches into an amphora, under a rock arch."""

from __future__ import annotations

from importlib.resources import files
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import open3d as o3d

__all__ = ["demo_scene"]


def demo_scene() -> o3d.geometry.TriangleMesh:
    """Return the built-in scene: an octopus that reaches into an amphora, under a rock arch.

    One connected, watertight, edge-manifold mesh, with arms that stand free and cross one another at several
    depths. It is read from the package anew by each call, so the caller may change it.

    Returns
    -------
    open3d.geometry.TriangleMesh
        91922 vertices and 184000 triangles in a box 103 wide (x), 96 high (y) and 80 deep (z), in scene
        units; y points up, z to the viewer, the scene stands on y = 0. It carries vertex normals and vertex
        colours in [0, 1].

    Notes
    -----
    `data_scripts/make_demo_scene.py` makes the file and describes how it is packed. Positions are whole
    multiples of 1/128 unit from the smallest corner.

    Examples
    --------
    >>> mesh = demo_scene()
    >>> len(mesh.vertices), len(mesh.triangles), mesh.is_edge_manifold(allow_boundary_edges=False)
    (91922, 184000, True)
    """
    import open3d as o3d

    with (files("o3d_relief") / "data" / "demo_scene.npz").open("rb") as file, np.load(file) as packed:
        vertices = packed["origin"] + packed["step"] * _sum(_two_bytes(packed["positions"]))
        colours = _sum(packed["colours"]) * (4.0 / 255.0)
        behind = _two_bytes(packed["corners"]).astype(np.int32)
    fresh = behind == 0
    corners = np.cumsum(fresh, dtype=np.int32) - fresh - behind
    mesh = o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector(vertices), o3d.utility.Vector3iVector(corners.reshape(-1, 3))
    )
    mesh.vertex_colors = o3d.utility.Vector3dVector(np.minimum(colours, 1.0))
    mesh.compute_vertex_normals()
    return mesh


def _two_bytes(planes: NDArray[np.uint8]) -> NDArray[np.uint16]:
    """Join the low bytes and the high bytes, (2, ...), to numbers (...)."""
    low, high = planes.astype(np.uint16)
    joined: NDArray[np.uint16] = low + (high << 8)
    return joined


def _sum(differences: NDArray[Any]) -> NDArray[Any]:
    """Undo the differences (3, n) between one vertex and the next, modulo their type: (n, 3)."""
    return np.ascontiguousarray(np.cumsum(differences, axis=1, dtype=differences.dtype).T)
