"""From the relief's unit to millimetres."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from o3d_relief.errors import MeshError
from o3d_relief.plate_params import PlateParams
from o3d_relief.solid.pieces import Piece

__all__ = ["check_extents", "fitted", "scale_for", "shortfall", "to_millimetres"]


def check_extents(points: NDArray[np.float64]) -> None:
    """Refuse points (n, 3) of a relief that have no extent along x or y, or do not rise above z = 0."""
    low, high = points.min(axis=0), points.max(axis=0)
    if high[0] <= low[0] or high[1] <= low[1] or high[2] <= 0.0:
        raise MeshError("The relief has no width or no depth: it cannot become a solid.")


def scale_for(points: NDArray[np.float64], params: PlateParams) -> float:
    """Return the millimetres in one unit of length, so that relief and plate get the right width.

    Parameters
    ----------
    points : (n, 2) float64
        x and y of the relief.
    params : PlateParams

    Returns
    -------
    float

    Examples
    --------
    >>> scale_for(np.array([[0, 0], [4, 2]]), PlateParams(width_mm=90, margin_mm=5))
    20.0
    """
    low, high = points.min(axis=0), points.max(axis=0)
    width = float(high[0] - low[0])
    if params.shape == "ellipse":
        half = (high - low) / 2.0
        half = np.where(half > 0.0, half, 1.0)
        width *= float(np.sqrt((((points - (low + high) / 2.0) / half) ** 2).sum(axis=1).max()))
    return (params.width_mm - 2.0 * params.edge_mm) / width


def to_millimetres(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], params: PlateParams
) -> tuple[NDArray[np.float64], float]:
    """Scale a relief to the size asked for and centre it.

    Parameters
    ----------
    vertices : (n, 3) float64
        The relief, in front of z = 0.
    faces : (m, 3) int64
    params : PlateParams

    Returns
    -------
    vertices : (n, 3) float64
        In millimetres; what lies at z = 0 stays there exactly.
    depth_ratio : float
        The scale of z over that of x and y: 1 keeps the relief's proportions.

    Raises
    ------
    MeshError
        A relief without width or depth.
    """
    used = vertices[np.unique(faces)]
    check_extents(used)
    low, high = used.min(axis=0), used.max(axis=0)
    scale = scale_for(used[:, :2], params)
    ratio = 1.0
    if params.depth_mm is not None:
        ratio = (params.depth_mm - params.back_mm) / (float(high[2]) * scale)
    middle = np.array([(low[0] + high[0]) / 2.0, (low[1] + high[1]) / 2.0, 0.0])
    return np.asarray((vertices - middle) * [scale, scale, scale * ratio]), ratio


def shortfall(box: Sequence[float], params: PlateParams) -> tuple[float, float]:
    """Return by how much a solid's relief must grow to have the size that was asked for.

    Parameters
    ----------
    box : (6,) float
        Least and greatest x, y, z of the solid.
    params : PlateParams

    Returns
    -------
    wider, deeper : float
        Factors for x and y, and for z; 1 where the plate has that size or none was asked for.

    Examples
    --------
    >>> shortfall((-40, -40, -4, 40, 40, 8), PlateParams(width_mm=80, depth_mm=16))
    (1.0, 1.5)
    """
    wider = params.width_mm / (box[3] - box[0]) if params.shape == "none" else 1.0
    if params.depth_mm is None or box[5] <= 0.0:
        return wider, 1.0
    return wider, (params.depth_mm - params.back_mm) / box[5]


def fitted(
    pieces: Sequence[Piece], params: PlateParams, *, wide: float = 1.0, deep: float = 1.0
) -> list[Piece]:
    """Take back what thickness has added to the extents.

    Parameters
    ----------
    pieces : sequence of Piece
        In millimetres.
    params : PlateParams
    wide, deep : float
        Further factors for x and y, and for z.

    Returns
    -------
    list of Piece
        Centred; their extents are those asked for, times the factors.
    """
    used = np.concatenate([piece.vertices for piece in pieces])
    low, high = used.min(axis=0), used.max(axis=0)
    middle = np.array([(low[0] + high[0]) / 2.0, (low[1] + high[1]) / 2.0, 0.0])
    scale = scale_for(used[:, :2], params) * wide
    if params.depth_mm is not None:
        deep *= (params.depth_mm - params.back_mm) / float(high[2])
    if np.abs(middle).max() == 0.0 and scale == deep == 1.0:
        return list(pieces)
    result = []
    for piece in pieces:
        moved = (piece.vertices - middle) * (scale, scale, 1.0)
        moved[:, 2] = np.where(moved[:, 2] > 0.0, moved[:, 2] * deep, moved[:, 2])
        result.append(replace(piece, vertices=moved))
    return result
