"""The steps from points to oriented normals: each takes what those before have found, returns its record.

They work on centred points of unit extent, so that neither far origins nor odd units cost precision.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from o3d_relief.errors import MeshError, ParameterError
from o3d_relief.limits import check_points
from o3d_relief.params import Triple, View
from o3d_relief.progress import Tick, silent
from o3d_relief.scan.ground import find_ground
from o3d_relief.scan.neighbours import Neighbours, find_neighbours, local_spacings, outliers, thin
from o3d_relief.scan.normals import agreement, check_normals, estimate_normals
from o3d_relief.scan.orientation import away_votes, edge_agreement, propagate, towards
from o3d_relief.scan_params import ScanParams
from o3d_relief.scan_records import (
    GroundStage,
    NormalsStage,
    OrientationStage,
    OutliersStage,
    PointsStage,
)
from o3d_relief.scene.arrays import CloudArrays
from o3d_relief.scene.weld import first_of_equal_rows

__all__ = [
    "Work",
    "ground_step",
    "normals_step",
    "orientation_step",
    "outliers_step",
    "points_step",
]

_LEAST_POINTS = 50
"""Fewer points are no scan."""

_AGREEING = 0.75
"""Share of a cloud's normals that must lie near the estimated ones; random ones do so in 3 of 10 points."""

_ALIKE = 0.9
"""Share of a cloud's normals that must point to the same side as their neighbours'."""

_DECIDED = 0.8
"""Share of the votes that shows that a cloud's normals point outwards as a whole, or inwards."""

_LARGEST = 1e100
"""A wider cloud has numbers that are no coordinates; their squares would overflow."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Work:
    """The points as the steps see them.

    Attributes
    ----------
    points : (n, 3) float64
        Centred, of unit extent.
    centre : (3,) float64
    size : float
        Extent of the cloud.
    neighbours : Neighbours
    local_spacing : (n,) float64
    """

    points: NDArray[np.float64]
    centre: NDArray[np.float64]
    size: float
    neighbours: Neighbours
    local_spacing: NDArray[np.float64]

    def back(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return points (m, 3) in the cloud's own frame and unit."""
        return points * self.size + self.centre


def points_step(cloud: CloudArrays, params: ScanParams, view: View) -> tuple[PointsStage, Work]:
    """Choose the points to be used and find their spacing."""
    finite = np.flatnonzero(np.isfinite(cloud.points).all(axis=1))
    _check_enough(len(finite), f"{len(cloud.points)} points of the cloud, {len(finite)} of them finite")
    points = cloud.points[finite]
    first = first_of_equal_rows(points)
    single = np.flatnonzero(first == np.arange(len(first)))
    _check_enough(len(single), f"{len(finite)} points of the cloud, {len(single)} of them apart")
    index, points = finite[single], points[single]
    centre = points.min(axis=0) / 2 + points.max(axis=0) / 2
    half = float(np.abs(points - centre).max())
    if not half < _LARGEST:
        raise MeshError(f"The points spread over {half:.3g}, which is too far for a scan.")
    size = 2.0 * half
    work = (points - centre) / size
    check_points(min(len(points), params.max_points))
    kept = _thinned(work, params.max_points)
    index, points, work = index[kept], points[kept], work[kept]
    neighbours = find_neighbours(work)
    local = local_spacings(neighbours)
    record = PointsStage(
        points=points,
        colors=None if cloud.colors is None else cloud.colors[index],
        cloud_index=index,
        spacing=float(np.median(local)) * size,
        local_spacing=local * size,
        view=view,
        counts={
            "cloud_points": len(cloud.points),
            "not_finite": len(cloud.points) - len(finite),
            "repeated": len(finite) - len(single),
            "thinned": len(single) - len(index),
            "points": len(index),
        },
    )
    return record, Work(points=work, centre=centre, size=size, neighbours=neighbours, local_spacing=local)


def _check_enough(count: int, what: str) -> None:
    if count < _LEAST_POINTS:
        raise MeshError(f"A surface needs at least {_LEAST_POINTS} points. Got the {what}.")


def _thinned(points: NDArray[np.float64], most: int) -> NDArray[np.int64]:
    """Choose at most `most` points, spread evenly."""
    kept = np.arange(len(points))
    sample = points[:: max(1, len(points) // 50_000)]
    area = len(sample) * float(np.median(local_spacings(find_neighbours(sample)))) ** 2
    cell = np.sqrt(area / most)
    while len(kept) > most:
        kept = thin(points, cell)
        cell *= 1.02 * np.sqrt(max(len(kept) / most, 1.0))
    return kept


def outliers_step(work: Work, params: ScanParams) -> OutliersStage:
    """Find the points that lie far from all others."""
    distance = work.neighbours.distance.mean(axis=1)
    far = np.zeros(len(distance), dtype=bool)
    if params.outliers is not None:
        far = outliers(distance, params.outliers)
    return OutliersStage(distance=distance * work.size, outlier=far, counts={"outliers": int(far.sum())})


def normals_step(
    work: Work,
    points: PointsStage,
    far: NDArray[np.bool_],
    cloud: CloudArrays,
    params: ScanParams,
    *,
    tick: Tick = silent,
) -> NormalsStage:
    """Estimate the normals, or take the cloud's own where they agree with the estimated ones."""
    estimated = estimate_normals(work.points, work.neighbours, ~far, tick=tick)
    usable: NDArray[np.bool_] = np.asarray(estimated.any(axis=1))
    _check_enough(int(usable.sum()), f"{int(usable.sum())} points of the cloud that lie on a surface")
    counts = {"on_no_surface": int((~usable & ~far).sum()), "own": 0, "own_zero": 0, "own_off": 0}
    own = check_normals(cloud.normals, len(cloud.points)) if params.file_normals else None
    if own is None:
        return NormalsStage(normals=estimated, from_file=False, counts=counts)
    own = np.where(usable[:, None], own[points.cloud_index], 0.0)
    agrees = agreement(own, estimated)
    zero = usable & ~own.any(axis=1)
    counts |= {"own_zero": int(zero.sum()), "own_off": int((usable & ~zero & ~agrees).sum())}
    if agrees.sum() < _AGREEING * usable.sum():
        return NormalsStage(normals=estimated, from_file=False, counts=counts)
    around = np.zeros_like(own)
    for column in work.neighbours.index.T:
        around += own[column]
    turned = np.where(np.einsum("nj,nj->n", estimated, around)[:, None] < 0.0, -estimated, estimated)
    counts["own"] = int(agrees.sum())
    return NormalsStage(normals=np.where(agrees[:, None], own, turned), from_file=True, counts=counts)


def ground_step(work: Work, normals: NormalsStage, params: ScanParams, view: View) -> GroundStage:
    """Find the floor or table, if that is asked for."""
    ground = np.zeros(len(work.points), dtype=bool)
    if params.remove_ground:
        usable = normals.normals.any(axis=1)
        ground[usable] = find_ground(
            work.points[usable],
            normals.normals[usable],
            _unit(view.up),
            float(np.median(work.local_spacing)),
            seed=params.seed,
        )
    return GroundStage(ground=ground, counts={"ground": int(ground.sum())})


def _unit(direction: Triple | str) -> NDArray[np.float64]:
    vector = np.asarray(cast(Triple, direction), dtype=np.float64)  # View has checked and converted it
    return np.asarray(vector / np.linalg.norm(vector))


def orientation_step(
    work: Work,
    normals: NormalsStage,
    ground: GroundStage,
    params: ScanParams,
    view: View,
    *,
    tick: Tick = silent,
) -> OrientationStage:
    """Turn the normals so that they point out of the surface."""
    used = np.flatnonzero(normals.normals.any(axis=1) & ~ground.ground)
    points, axes = work.points[used], normals.normals[used]
    spacing = float(np.median(work.local_spacing))
    if params.sensor is not None:
        way = np.array(params.sensor) - work.centre
        if not np.abs(way).max() < _LARGEST * work.size:
            raise ParameterError(f"sensor is too far from the points. Got {params.sensor} instead.")
        sensor = way / work.size
        method, turned = "sensor", towards(points, axes, sensor)
    else:
        votes = away_votes(points, axes, spacing, front=_unit(view.front), up=_unit(view.up), tick=tick)
        sign = _own_sign(points, axes, votes) if normals.from_file else 0.0
        method = "cloud" if sign else "propagation"
        turned = sign * axes if sign else propagate(points, axes, votes, spacing)
    oriented = np.zeros_like(work.points)
    oriented[used] = turned
    counts = {"oriented": len(used), "turned": int(((turned * axes).sum(axis=1) < 0.0).sum())}
    return OrientationStage(normals=oriented, method=method, counts=counts)


def _own_sign(points: NDArray[np.float64], axes: NDArray[np.float64], votes: NDArray[np.float64]) -> float:
    """Return 1 where the cloud's own normals point outwards, -1 for inwards, 0 where they are mixed."""
    _, index = cKDTree(points).query(points, k=2, workers=-1)
    if edge_agreement(points, axes, index[:, 1]) < _ALIKE:
        return 0.0
    total = float(np.abs(votes).sum())
    outwards = float(votes[votes > 0.0].sum()) / total if total > 0.0 else 1.0
    if outwards >= _DECIDED:
        return 1.0
    return -1.0 if outwards <= 1.0 - _DECIDED else 0.0
