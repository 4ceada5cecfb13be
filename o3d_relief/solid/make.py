"""From a relief to one closed body on its plate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from o3d_relief.errors import MeshError
from o3d_relief.param_checks import check_kind, given
from o3d_relief.plate_params import PlateParams
from o3d_relief.progress import OnProgress, Progress, Tick, silent
from o3d_relief.relief import Relief
from o3d_relief.scene.arrays import MeshArrays, from_open3d
from o3d_relief.solid.bodies import joined
from o3d_relief.solid.body import Solid, manifold_of
from o3d_relief.solid.parts import closed_parts
from o3d_relief.solid.pieces import Piece
from o3d_relief.solid.plate import as_plate, outline, plate, pockets
from o3d_relief.solid.refine import refined_for_texture
from o3d_relief.solid.silhouette import rough_silhouette
from o3d_relief.solid.sizes import fitted, shortfall, to_millimetres
from o3d_relief.solid.surface_colors import surface_colors
from o3d_relief.solid.walls import with_thicker_walls

if TYPE_CHECKING:
    import manifold3d

__all__ = ["make_solid", "solid_of"]

_ATTEMPTS = 3
_EXACT = 1e-9
"""Share of a length by which it may be off."""
_COLOR_MM = 0.8
"""Longest edge where a texture changes: colours of prints are not much finer."""
_SQUARE_MM = 0.5
"""Of the silhouette of what is that rough."""
_CELL_MM = 4.0
"""Longest edge of the plate's faces under outlines of ten thousands of corners.

Each face of the plate is cut and triangulated by itself: where two outlines touch, as rough ones do, the
triangles may lie over each other, but not further than this.
"""


def make_solid(
    relief: Relief, params: PlateParams | None = None, *, on_progress: OnProgress | None = None
) -> Solid:
    """Make one closed body of a relief and a plate.

    The relief's surface stays as it is, scaled; where `depth_mm` asks for another depth than the relief
    has in proportion, z is scaled on its own (make the relief with the right `ReliefParams.depth` to avoid
    that).

    Parameters
    ----------
    relief : Relief
        Never modified.
    params : PlateParams, optional
    on_progress : callable, optional
        Called with "solid" and the share of the work that is done, None where that is not known. Where it
        returns False, or raises, the work ends.

    Returns
    -------
    Solid
        `width_mm` wide and `depth_mm` deep, its back flat.

    Raises
    ------
    MeshError
        Nothing of the relief encloses a volume.
    ParameterError
        A plate too small for what it is to hang from, or something else than a relief and a plate.
    Cancelled
        `on_progress` returned False.

    Examples
    --------
    >>> import open3d as o3d
    >>> from o3d_relief.params import ReliefParams
    >>> from o3d_relief.pipeline import make_relief
    >>> relief = make_relief(o3d.geometry.TriangleMesh.create_sphere(), ReliefParams(k=4))
    >>> make_solid(relief, PlateParams(width_mm=80, depth_mm=20)).size[[0, 2]].round(3).tolist()
    [80.0, 20.0]
    """
    params = given("params", params, PlateParams)
    check_kind("relief", relief, Relief, "make_relief")
    progress = Progress(on_progress)
    progress.begin("solid")
    solid = solid_of(from_open3d(relief.mesh), params, tick=progress.tick)
    progress.end()
    return solid


def solid_of(mesh: MeshArrays, params: PlateParams, *, tick: Tick = silent) -> Solid:
    """Make one closed body of a surface in front of z = 0 and a plate; see `make_solid`.

    Parameters
    ----------
    mesh : MeshArrays
        In any unit, cut at z = 0 exactly, seen from z+.
    params : PlateParams
    tick : callable, optional
        Called between the steps; it may raise to end the work.
    """
    width = float(np.ptp(mesh.vertices[mesh.faces.ravel(), 0]))
    mesh = refined_for_texture(mesh, _COLOR_MM * width / params.width_mm)
    vertices, depth_ratio = to_millimetres(mesh.vertices, mesh.faces, params)
    colors = surface_colors(mesh)
    tick(0.2)
    parts = closed_parts(vertices, mesh.faces, floor=-params.embed_mm, thickness=params.thickness_mm)
    if not parts.pieces:
        raise MeshError("Nothing of the relief encloses a volume: there is nothing to print.")
    # Once, but where what was furthest out turns out to be loose, or a crumb, and is left out.
    wide = deep = 1.0
    for _ in range(_ATTEMPTS):
        tick(0.5)
        pieces = fitted(parts.pieces, params, wide=wide, deep=deep)
        fine = parts.counts["filled"] > 0
        whole, settled = joined(_on_plate(pieces, colors, params, fine=fine), params)
        wider, deeper = shortfall(whole.bounding_box(), params)
        if abs(wider - 1.0) < _EXACT and abs(deeper - 1.0) < _EXACT:
            break
        wide, deep = wide * wider, deep * deeper
    depth_ratio *= deep / wide
    tick(0.8)
    result = Solid.from_manifold(whole, colored=colors is not None)
    counts = {f"parts_{name}": count for name, count in parts.counts.items()}
    return replace(result, counts={"depth_ratio": depth_ratio, **counts, **settled})


def _on_plate(
    pieces: Sequence[Piece], colors: NDArray[np.float64] | None, params: PlateParams, *, fine: bool
) -> manifold3d.Manifold:
    """Unite everything; `fine` makes small faces of the plate."""
    import manifold3d

    body = _united(pieces, colors)
    # The back of a shell may reach further down than the plate is thick.
    lowest = 0.0 if params.shape == "none" else -(params.embed_mm + params.base_mm) / 2.0
    if body.bounding_box()[2] < lowest:
        body = body - _below(lowest, body) if fine else body.trim_by_plane((0.0, 0.0, 1.0), lowest)
    main, shape = body, manifold3d.CrossSection()
    if params.shape != "none":
        shape = outline(_silhouette(pieces, body, params, fine=fine), params)
        under = plate(shape, params)
        main = (under.refine_to_length(_CELL_MM) if fine else under) + body
    if params.thicken:
        main = with_thicker_walls(Solid.from_manifold(main, colored=colors is not None), params.min_wall_mm)
    return main if params.hanging == "none" else main - pockets(shape, params)


def _below(top: float, body: manifold3d.Manifold) -> manifold3d.Manifold:
    """Return a box around all of a body that lies below z = `top`."""
    low_x, low_y, low_z, high_x, high_y, _ = body.bounding_box()
    size = (high_x - low_x + 2.0, high_y - low_y + 2.0, top - low_z + 1.0)
    corner = (low_x - 1.0, low_y - 1.0, low_z - 1.0)
    return as_plate(type(body).cube(size).translate(corner).refine_to_length(_CELL_MM))


def _united(pieces: Sequence[Piece], colors: NDArray[np.float64] | None) -> manifold3d.Manifold:
    import manifold3d

    bodies = [
        manifold_of(
            piece.vertices,
            piece.faces,
            colors=np.ones((1, 3)) if colors is None else colors[piece.source],
            is_plate=False,
        )
        for piece in pieces
    ]
    return manifold3d.Manifold.batch_boolean(bodies, manifold3d.OpType.Add)


def _silhouette(
    pieces: Sequence[Piece], body: manifold3d.Manifold, params: PlateParams, *, fine: bool
) -> manifold3d.CrossSection:
    """Return what the relief covers seen from the front; its convex hull where the shape needs no more."""
    import manifold3d

    if params.shape == "contour" and fine:
        return rough_silhouette(pieces, _SQUARE_MM)
    if params.shape == "contour":
        return manifold3d.CrossSection(body.project().to_polygons(), manifold3d.FillRule.Positive)
    points = np.concatenate([piece.vertices[:, :2] for piece in pieces])
    return manifold3d.CrossSection.hull_points(points)
