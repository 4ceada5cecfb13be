"""Several meshes side by side, from several sides, at one scale and in one light."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from o3d_relief.errors import ParameterError
from o3d_relief.scene.convert import check_mesh
from o3d_relief.show.camera import fit_scale, view_direction
from o3d_relief.show.render import plate_bounds, render
from o3d_relief.show.sheets import contact_sheet

if TYPE_CHECKING:
    import open3d as o3d

__all__ = ["comparison_sheet"]


_ANOTHER_UNIT = 10.0
"""Millimetres are by so much smaller than centimetres."""


def comparison_sheet(
    meshes: Mapping[str, o3d.geometry.TriangleMesh],
    yaws: Sequence[float] = (0.0,),
    *,
    plates: Collection[str] = (),
    panel: tuple[int, int] = (460, 460),
) -> NDArray[np.uint8]:
    """Show meshes side by side, a column for each and a row for each side.

    Parameters
    ----------
    meshes : mapping of str to open3d.geometry.TriangleMesh
        By their titles; in the relief frame and in one unit. One that is ten times as large as another is
        refused: it may be in another unit. Each lies in the middle of its panels.
    yaws : sequence of float
        Degrees to the right of the front.
    plates : collection of str
        Titles of the meshes that get a plate at z = 0.
    panel : (width, height)
        Of each picture at most, in pixels; less where the views are narrow or flat.

    Returns
    -------
    (height, width, 3) uint8

    Raises
    ------
    ParameterError
        No mesh, no view, a plate for a mesh that is not there, or one mesh ten times as large as another.
    MeshError
        Something else than a mesh, or one without a triangle to draw.
    """
    if not meshes or len(yaws) == 0:
        raise ParameterError("A comparison needs a mesh and a view.")
    unknown = sorted(set(plates) - set(meshes))
    if unknown:
        raise ParameterError(f"plates must be among {', '.join(meshes)}. Got {unknown[0]!r} instead.")
    boxes = {name: _box(name, mesh) for name, mesh in meshes.items()}
    _check_unit(boxes)
    views = [view_direction(yaw) for yaw in yaws]
    framed = [_with_plate(box) if name in plates else box for name, box in boxes.items()]
    pairs = [(box, view) for box in framed for view in views]
    scale = min(fit_scale(box, view, (0, 1, 0), panel) for box, view in pairs)
    # Pictures no wider and no higher than the widest and the highest view need.
    widest = min(fit_scale(box, view, (0, 1, 0), (1.0, np.inf)) for box, view in pairs)
    highest = min(fit_scale(box, view, (0, 1, 0), (np.inf, 1.0)) for box, view in pairs)
    size = max(1, round(scale / widest)), max(1, round(scale / highest))
    pictures = [
        render(mesh, direction=view, size=size, plate=name in plates, bounds=boxes[name], scale=scale)
        for view in views
        for name, mesh in meshes.items()
    ]
    titles = list(meshes) + [""] * (len(pictures) - len(meshes))
    labels = [f"{yaw:g}°" for yaw in yaws] if len(yaws) > 1 else ()
    return contact_sheet(pictures, len(meshes), titles=titles, row_labels=labels)


def _box(name: str, mesh: o3d.geometry.TriangleMesh) -> NDArray[np.float64]:
    """Return the least and the greatest corner (2, 3) of what the faces of a mesh use."""
    check_mesh(f"The mesh {name!r}", mesh)
    vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.triangles)
    used = vertices[faces[(faces >= 0) & (faces < len(vertices))]]
    if len(used) == 0:
        return np.zeros((2, 3))  # nothing to draw, which is said later
    return np.array([used.min(axis=0), used.max(axis=0)])


def _check_unit(boxes: Mapping[str, NDArray[np.float64]]) -> None:
    """Refuse meshes whose larger sides (x or y) are as different as two units."""
    sides = {name: float(np.ptp(box, axis=0)[:2].max()) for name, box in boxes.items()}
    if min(sides.values()) <= 0.0:
        return  # nothing to draw, which is said later
    small, large = min(sides, key=sides.__getitem__), max(sides, key=sides.__getitem__)
    if sides[small] * _ANOTHER_UNIT <= sides[large] * (1.0 + 1e-6):
        raise ParameterError(
            f"A comparison is drawn at one scale, but {large!r} is {sides[large]:.4g} large and {small!r} "
            f"{sides[small]:.4g}: give meshes in one unit, and less than ten times as large as each other."
        )


def _with_plate(box: NDArray[np.float64]) -> NDArray[np.float64]:
    slab = plate_bounds(box)
    return np.array([np.minimum(box[0], slab[0]), np.maximum(box[1], slab[1])])
