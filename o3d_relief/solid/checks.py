"""Can it be printed? Measured on the finished mesh, without the library that made it."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from o3d_relief.plate_params import PlateParams
from o3d_relief.rays import unit_box
from o3d_relief.solid.body import Solid
from o3d_relief.solid.chain import bodies

__all__ = ["SolidReport", "check_solid", "wall_thickness"]

_SIZE_TOLERANCE = 0.01
"""Millimetres between the size asked for and the one found."""
_FLAT_TOLERANCE = 1e-6
"""Millimetres between the back and its plane."""
_THIN_SHARE = 1e-3
"""Share of the surface that may be thinner than the smallest wall: edges are."""
_OVERLAP_SHARE = 1e-3
"""Share of the volume that may be covered twice."""
_LINES = 400
"""Lines along x and along y on which the inside is followed through the solid."""


@dataclass(frozen=True, kw_only=True)
class SolidReport:
    """What was measured on a solid, in millimetres.

    Attributes
    ----------
    verdict : str
        "pass", "warnings" or "fail".
    failures, warnings : tuple of str
        A sentence for each thing that does not hold.
    size_mm : (x, y, z)
    volume_mm3, area_mm2 : float
    triangles : int
    watertight, oriented : bool
        Every edge has exactly two faces; they turn the same way round.
    bodies : int
        Connected parts; 1 is one piece.
    back_deviation_mm : float
        Largest distance of the back's corners from its plane, -1 where nothing lies in it.
    overlap_share : float
        Share of the volume that surfaces which pass through each other cover twice, or leave
        inside out, on a grid of lines.
    thinnest_mm : float
        A thousandth of the surface is thinner than this.
    thin_area_mm2 : float
        Area of the surface behind which the wall is thinner than `min_wall_mm`.
    overhang_area_mm2 : float
        Area that needs support in the print direction, without what lies on the bed.
    counts : dict of str to float
        What was settled while the solid was made.
    """

    verdict: str
    failures: tuple[str, ...]
    warnings: tuple[str, ...]
    size_mm: tuple[float, float, float]
    volume_mm3: float
    area_mm2: float
    triangles: int
    watertight: bool
    oriented: bool
    bodies: int
    back_deviation_mm: float
    overlap_share: float
    thinnest_mm: float
    thin_area_mm2: float
    overhang_area_mm2: float
    counts: dict[str, float]

    def values(self) -> dict[str, Any]:
        """Return everything as plain values, for JSON."""
        return asdict(self)


def check_solid(solid: Solid, params: PlateParams) -> SolidReport:
    """Measure a solid and judge it.

    Parameters
    ----------
    solid : Solid
    params : PlateParams
        What was asked for.

    Returns
    -------
    SolidReport
    """
    vertices, faces = solid.vertices, solid.faces
    watertight, oriented = _edges_paired(faces)
    a, b, c = vertices[faces].transpose(1, 0, 2)
    normals = np.cross(b - a, c - a) / 2.0
    area = np.linalg.norm(normals, axis=1)
    walls = wall_thickness(solid)
    values: dict[str, Any] = {
        "size_mm": tuple(float(length) for length in solid.size),
        "volume_mm3": solid.volume,
        "area_mm2": float(area.sum()),
        "triangles": len(faces),
        "watertight": watertight,
        "oriented": oriented,
        "bodies": int(bodies(faces).max()) + 1,
        "back_deviation_mm": _back_deviation(vertices, faces, normals, params),
        "overlap_share": _overlap(vertices, faces),
        "thinnest_mm": _quantile(walls, area, 1e-3),
        "thin_area_mm2": float(area[walls < params.min_wall_mm].sum()),
        "overhang_area_mm2": _overhang(vertices, faces, normals, area, params),
        "counts": dict(solid.counts),
    }
    failures, warnings = _failures(values, params), _warnings(values, params)
    verdict = "fail" if failures else "warnings" if warnings else "pass"
    return SolidReport(verdict=verdict, failures=failures, warnings=warnings, **values)


def wall_thickness(solid: Solid) -> NDArray[np.float64]:
    """Measure the wall behind each face, straight into the solid.

    Parameters
    ----------
    solid : Solid

    Returns
    -------
    (m,) float64
        In millimetres, from the middle of the face to where the ray leaves the solid.
    """
    scene, middle, size = unit_box(solid.vertices, solid.faces)
    a, b, c = solid.vertices[solid.faces].transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    unit = np.where(length > 0.0, normals / np.where(length > 0.0, length, 1.0), [0.0, 0.0, 1.0])
    # float32 rays start a hair inside, or they would hit their own face.
    start = ((a + b + c) / 3.0 - middle) / size - 1e-5 * unit
    rays = np.concatenate([start, -unit], axis=1).astype(np.float32)
    hit = scene.cast_rays(o3d.core.Tensor(rays))["t_hit"].numpy().astype(np.float64)
    return np.where(np.isfinite(hit), (hit + 1e-5) * size, 0.0)


def _edges_paired(faces: NDArray[np.int64]) -> tuple[bool, bool]:
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    count = int(faces.max()) + 1
    _, times = np.unique(np.minimum(start, end) * count + np.maximum(start, end), return_counts=True)
    forward, backward = np.sort(start * count + end), np.sort(end * count + start)
    return bool((times == 2).all()), bool(np.array_equal(forward, backward))


def _back_deviation(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    normals: NDArray[np.float64],
    params: PlateParams,
) -> float:
    """Measure the corners of the faces that turn to the back and lie in its plane, roughly."""
    z = vertices[faces, 2] + params.back_mm
    facing = normals[:, 2] < -0.999 * np.linalg.norm(normals, axis=1)
    back = facing & (np.abs(z) < 0.1).all(axis=1)
    return float(np.abs(z[back]).max()) if back.any() else -1.0


def _overlap(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> float:
    """Follow lines from the viewer to the back: inside, each place must be entered once."""
    scene, middle, size = unit_box(vertices, faces)
    low, high = (vertices.min(axis=0) - middle) / size, (vertices.max(axis=0) - middle) / size
    # Off the symmetric places, where lines would run along edges.
    steps = (np.arange(_LINES) + 0.5137) / _LINES
    x, y = np.meshgrid(low[0] + steps * (high[0] - low[0]), low[1] + steps * (high[1] - low[1]))
    start = np.stack([x.ravel(), y.ravel(), np.full(x.size, high[2] + 0.1)], axis=1)
    rays = np.concatenate([start, np.tile([0.0, 0.0, -1.0], (x.size, 1))], axis=1).astype(np.float32)
    hits = scene.list_intersections(o3d.core.Tensor(rays))
    line, t = hits["ray_ids"].numpy().astype(np.int64), hits["t_hit"].numpy().astype(np.float64)
    a, b, c = vertices[faces[hits["primitive_ids"].numpy()]].transpose(1, 0, 2)
    entered = np.sign(np.cross(b - a, c - a)[:, 2])
    order = np.lexsort((t, line))
    line, t, entered = line[order], t[order], entered[order]
    inside = np.cumsum(entered)
    same = line[1:] == line[:-1]
    # Lines that hit an edge see one face too many: they are left out.
    total = np.bincount(line, weights=entered, minlength=x.size)
    clean = total[line] == 0.0
    inside = inside - (np.cumsum(total) - total)[line]
    length = np.where(same & clean[1:], np.diff(t), 0.0)
    solid, wrong = inside[:-1] > 0.0, (inside[:-1] > 1.0) | (inside[:-1] < 0.0)
    return float(length[wrong].sum() / max(length[solid].sum(), 1e-300))


def _overhang(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    normals: NDArray[np.float64],
    area: NDArray[np.float64],
    params: PlateParams,
) -> float:
    axis = {"x": 0, "y": 1, "z": 2}[params.print_direction]
    steep = normals[:, axis] < -np.sin(np.radians(params.overhang_degrees)) * area
    along = vertices[faces, axis]
    on_bed = (along - vertices[:, axis].min() < 1e-3).all(axis=1)
    return float(area[steep & ~on_bed].sum())


def _quantile(values: NDArray[np.float64], weights: NDArray[np.float64], share: float) -> float:
    order = np.argsort(values)
    cumulated = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(cumulated, share * cumulated[-1])])


def _failures(values: dict[str, Any], params: PlateParams) -> tuple[str, ...]:
    failures = []
    if not values["watertight"]:
        failures.append("The mesh is not watertight: there are edges without exactly two faces.")
    if not values["oriented"]:
        failures.append("The faces do not all turn outward.")
    if values["volume_mm3"] <= 0.0:
        failures.append(f"The volume is not positive: {values['volume_mm3']:.3g} mm3.")
    width, _, depth = values["size_mm"]
    for name, found, asked in (("wide", width, params.width_mm), ("deep", depth, params.depth_mm)):
        if asked is not None and abs(found - asked) > _SIZE_TOLERANCE:
            failures.append(f"The solid is {found:.3f} mm {name}, not {asked:g} mm.")
    if values["back_deviation_mm"] < 0.0:
        failures.append("The solid has no flat back.")
    elif values["back_deviation_mm"] > _FLAT_TOLERANCE:
        failures.append(f"The back is uneven by {values['back_deviation_mm']:.3g} mm.")
    return tuple(failures)


def _warnings(values: dict[str, Any], params: PlateParams) -> tuple[str, ...]:
    warnings = []
    if values["bodies"] > 1:
        counts = values["counts"]
        warnings.append(
            f"{values['bodies'] - 1} parts touch nothing, {counts.get('loose_mm3', 0.0):.0f} mm3 in all: "
            "loose='bridge' ties them, loose='remove' leaves them out."
        )
    if values["thin_area_mm2"] > _THIN_SHARE * values["area_mm2"]:
        warnings.append(
            f"{values['thin_area_mm2']:.0f} mm2 of {values['area_mm2']:.0f} mm2 are thinner than "
            f"{params.min_wall_mm:g} mm."
        )
    if values["overlap_share"] > _OVERLAP_SHARE:
        warnings.append(
            f"Surfaces pass through each other: {100.0 * values['overlap_share']:.2g} % of the volume counts "
            "twice."
        )
    if values["counts"].get("depth_ratio", 1.0) > 1.0 + 1e-3 and params.depth_mm is not None:
        warnings.append(
            f"The relief is shallower than asked for: its depth is stretched by "
            f"{values['counts']['depth_ratio']:.2f}."
        )
    return tuple(warnings)
