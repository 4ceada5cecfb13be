"""The records of a scan that becomes a surface, stage by stage.

Arrays are in the cloud's own frame and unit, and read-only. n is the number of points after the first
stage; later stages mark points instead of dropping them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from o3d_relief.params import View
from o3d_relief.records import StageRecord

__all__ = [
    "GroundStage",
    "NormalsStage",
    "OrientationStage",
    "OutliersStage",
    "PartsStage",
    "PointsStage",
    "SkinStage",
    "SurfaceStage",
]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class PointsStage(StageRecord):
    """The points that are used.

    Attributes
    ----------
    points : (n, 3) float64
        Finite, no two alike, thinned where there were too many.
    colors : (n, 3) float64 or None
        From 0 to 1.
    cloud_index : (n,) int64
        Point of the cloud.
    spacing : float
        Side of the square that one point stands for, the median.
    local_spacing : (n,) float64
        The same around each point.
    view : View
        How the cloud is looked at.
    """

    name: ClassVar[str] = "points"
    points: NDArray[np.float64]
    colors: NDArray[np.float64] | None
    cloud_index: NDArray[np.int64]
    spacing: float
    local_spacing: NDArray[np.float64]
    view: View


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class OutliersStage(StageRecord):
    """Points far from all others.

    Attributes
    ----------
    distance : (n,) float64
        Mean distance to the neighbours.
    outlier : (n,) bool
    """

    name: ClassVar[str] = "outliers"
    distance: NDArray[np.float64]
    outlier: NDArray[np.bool_]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class NormalsStage(StageRecord):
    """The normals, which way they point still open.

    Attributes
    ----------
    normals : (n, 3) float64
        Of unit length; zero for outliers.
    from_file : bool
        Whether they are the cloud's own.
    """

    name: ClassVar[str] = "normals"
    normals: NDArray[np.float64]
    from_file: bool


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class GroundStage(StageRecord):
    """The floor or table.

    Attributes
    ----------
    ground : (n,) bool
        The points on it or below it, all False where it was not asked for.
    """

    name: ClassVar[str] = "ground"
    ground: NDArray[np.bool_]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class OrientationStage(StageRecord):
    """The normals, all of them pointing out of the surface.

    Attributes
    ----------
    normals : (n, 3) float64
        Of unit length; zero for points that are not used.
    method : str
        "sensor" (towards its position), "cloud" (the cloud's own) or "propagation".
    """

    name: ClassVar[str] = "orientation"
    normals: NDArray[np.float64]
    method: str


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class SurfaceStage(StageRecord):
    """The closed Poisson surface, with everything that it invents.

    Attributes
    ----------
    vertices : (v, 3) float64
    faces : (f, 3) int64
    density : (v,) float64
        Depth of the octree at which the points reach their sampling density.
    depth : int
        Depth of the octree.
    """

    name: ClassVar[str] = "surface"
    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    density: NDArray[np.float64]
    depth: int


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class SkinStage(StageRecord):
    """The surface without what no points support.

    Attributes
    ----------
    distance : (v,) float64
        From each vertex of the Poisson surface to the nearest point, in local spacings.
    vertices : (s, 3) float64
    faces : (t, 3) int64
    """

    name: ClassVar[str] = "skin"
    distance: NDArray[np.float64]
    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class PartsStage(StageRecord):
    """The mesh of the scan: the parts that are large enough.

    Attributes
    ----------
    vertices : (w, 3) float64
    faces : (g, 3) int64
    colors : (w, 3) float64 or None
    """

    name: ClassVar[str] = "parts"
    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    colors: NDArray[np.float64] | None
