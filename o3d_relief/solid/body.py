"""A closed body in millimetres, and the way to manifold3d and back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from o3d_relief.errors import MeshError
from o3d_relief.frozen import Frozen

if TYPE_CHECKING:
    import manifold3d
    import open3d as o3d

__all__ = ["PLATE_COLOR", "Solid", "built", "manifold_of"]

PLATE_COLOR = (0.8, 0.79, 0.77)
"""sRGB colour of everything that is not the relief's own surface, where the relief has colours."""


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Solid(Frozen):
    """A closed triangle mesh in millimetres.

    It lies in the relief's frame: x to the right, y up, z to the viewer. The relief plane is z = 0, the
    flat back z = -base. Arrays are read-only.

    Attributes
    ----------
    vertices : (n, 3) float64
        In millimetres.
    faces : (m, 3) int64
        Outward oriented: every edge is used once in each direction.
    colors : (n, 3) float64, optional
        sRGB, from 0 to 1.
    is_plate : (m,) bool
        True for faces that are not the relief's own surface: plate, back, cuts. Where there are
        colours these have PLATE_COLOR; the vertices at the seam carry the colour of the relief.
    counts : mapping of str to float
        What was settled on the way (parts closed in each way, loose bodies, voids filled, ...).
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    colors: NDArray[np.float64] | None = None
    is_plate: NDArray[np.bool_]
    counts: Mapping[str, float] = field(default_factory=dict)

    def __repr__(self) -> str:
        x, y, z = self.size
        return f"<Solid: {len(self.faces)} triangles, {x:.2f} x {y:.2f} x {z:.2f} mm>"

    @property
    def size(self) -> NDArray[np.float64]:
        """(3,) extents along x, y and z in millimetres."""
        return np.asarray(np.ptp(self.vertices, axis=0))

    @property
    def volume(self) -> float:
        """Volume in cubic millimetres."""
        a, b, c = (self.vertices - self.vertices.mean(axis=0))[self.faces].transpose(1, 0, 2)
        return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6.0

    def corner_colors(self) -> NDArray[np.float64]:
        """Return the colours of the corners of each face, without bleeding across the seam.

        Returns
        -------
        (m, 3, 3) float64
            By face, corner and channel; white where the solid has no colours.
        """
        if self.colors is None:
            return np.ones((len(self.faces), 3, 3))
        return np.where(self.is_plate[:, None, None], PLATE_COLOR, self.colors[self.faces])

    def to_open3d(self) -> o3d.geometry.TriangleMesh:
        """Copy the solid to an Open3D mesh.

        Returns
        -------
        open3d.geometry.TriangleMesh
            Where there are colours, the vertices of the seam are there twice, so that the relief's colours
            do not run over the plate.
        """
        import open3d as o3d

        place, rgb, _, corners = self.seam_split()
        if self.colors is None:
            place, corners = np.arange(len(self.vertices)), self.faces
        mesh = o3d.geometry.TriangleMesh(
            o3d.utility.Vector3dVector(self.vertices[place]),
            o3d.utility.Vector3iVector(corners.astype(np.int32)),
        )
        if self.colors is not None:
            mesh.vertex_colors = o3d.utility.Vector3dVector(rgb)
        return mesh

    def to_manifold(self) -> manifold3d.Manifold:
        """Hand the solid to manifold3d, for booleans.

        Returns
        -------
        manifold3d.Manifold
            With four properties for each vertex: red, green, blue, and 1 on the plate, 0 on the relief.

        Raises
        ------
        MeshError
            The mesh is not a manifold.
        """
        place, rgb, plate, corners = self.seam_split()
        twins = np.flatnonzero(place[1:] == place[:-1]) + 1
        return built(np.column_stack([self.vertices[place], rgb, plate]), corners, twins, twins - 1)

    def seam_split(
        self,
    ) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.bool_], NDArray[np.int64]]:
        """Take the vertices of the seam twice: with the relief's and with the plate's colour.

        Returns
        -------
        place : (q,) int64
            The vertex that each is a copy of.
        rgb : (q, 3) float64
        plate : (q,) bool
        corners : (m, 3) int64
        """
        used, corners = np.unique(2 * self.faces + self.is_plate[:, None], return_inverse=True)
        place, plate = used // 2, (used % 2).astype(bool)
        rgb = np.ones((len(used), 3))
        if self.colors is not None:
            rgb = np.where(plate[:, None], PLATE_COLOR, self.colors[place])
        return place, rgb, plate, corners.reshape(-1, 3)

    @classmethod
    def from_manifold(cls, manifold: manifold3d.Manifold, *, colored: bool) -> Solid:
        """Take the result of booleans over.

        Parameters
        ----------
        manifold : manifold3d.Manifold
            With the properties that `to_manifold` and `manifold_of` give.
        colored : bool
            Keep the colours.

        Raises
        ------
        MeshError
            manifold3d could not compute it, or nothing is left.
        """
        if manifold.num_tri() == 0:
            raise MeshError(f"No solid is left of the mesh ({manifold.status().name}).")
        mesh = manifold.to_mesh64()
        properties = np.asarray(mesh.vert_properties)
        corners = np.asarray(mesh.tri_verts).astype(np.int64)
        target = np.arange(len(properties))
        target[np.asarray(mesh.merge_from_vert, dtype=np.int64)] = np.asarray(
            mesh.merge_to_vert, dtype=np.int64
        )
        used, index = np.unique(target, return_inverse=True)
        is_plate = properties[corners, 6].mean(axis=1) > 0.5
        colors = None
        if colored:
            # Of the twins at a place, the relief's gives the colour.
            order = np.argsort(-properties[:, 6], kind="stable")
            colors = np.empty((len(used), 3))
            colors[index[order]] = np.clip(properties[order, 3:6], 0.0, 1.0)
        return cls(vertices=properties[used, :3], faces=index[corners], colors=colors, is_plate=is_plate)


def manifold_of(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    *,
    colors: NDArray[np.float64] | None = None,
    is_plate: bool,
) -> manifold3d.Manifold:
    """Hand a closed mesh to manifold3d with the properties that a Solid's manifold has.

    Parameters
    ----------
    vertices : (n, 3) float64
        In millimetres.
    faces : (m, 3) int64
    colors : (n, 3) float64, optional
        sRGB, from 0 to 1; the plate's colour where omitted.
    is_plate : bool
        False for the relief's own surface.

    Returns
    -------
    manifold3d.Manifold

    Raises
    ------
    MeshError
        The mesh is not an oriented manifold.

    Examples
    --------
    >>> v = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    >>> f = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    >>> round(manifold_of(v, f, is_plate=True).volume(), 6)
    0.166667
    """
    rgb = np.broadcast_to(np.asarray(PLATE_COLOR if colors is None else colors), (len(vertices), 3))
    none = np.zeros(0, dtype=np.int64)
    return built(np.column_stack([vertices, rgb, np.full(len(vertices), float(is_plate))]), faces, none, none)


def built(
    properties: NDArray[np.float64],
    faces: NDArray[np.int64],
    merge_from: NDArray[np.int64],
    merge_to: NDArray[np.int64],
) -> manifold3d.Manifold:
    """Hand vertices (n, 7), with the properties of a Solid's manifold, and what to merge to manifold3d."""
    import manifold3d

    mesh = manifold3d.Mesh64(
        vert_properties=np.ascontiguousarray(properties),
        tri_verts=np.ascontiguousarray(faces, dtype=np.uint64),
        merge_from_vert=merge_from.astype(np.uint64),
        merge_to_vert=merge_to.astype(np.uint64),
    )
    manifold = manifold3d.Manifold(mesh)
    if manifold.status() != manifold3d.Error.NoError:
        raise MeshError(f"The mesh is not a closed manifold ({manifold.status().name}).")
    return manifold
