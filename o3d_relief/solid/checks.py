"""Can it be printed? Measured on the finished mesh, without the library that made it."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from o3d_relief.param_checks import check_kind
from o3d_relief.plate_params import PlateParams
from o3d_relief.solid.body import Solid
from o3d_relief.solid.chain import bodies
from o3d_relief.solid.measures import (
    back_deviation,
    edges_paired,
    overhang_area,
    overlap_share,
    quantile,
    walls_sampled,
    winding_number,
)

__all__ = ["SolidReport", "check_solid"]

_SIZE_TOLERANCE = 0.01
"""Millimetres between the size asked for and the one found."""
_FLAT_TOLERANCE = 1e-6
"""Millimetres between the back and its plane."""
_THIN_SHARE = 1e-3
"""Share of the surface that may be thinner than the smallest wall: edges are."""
_ADVICE = {
    "report": ": loose='bridge' ties them, loose='remove' leaves them out",
    "bridge": ", and nothing lies behind them to tie them to: loose='remove' leaves them out",
    "remove": "",
}
"""What can be done about loose parts, by what was asked for already."""
_OVERLAP_SHARE = 1e-3
"""Share of the volume that may be covered twice."""


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
        Connected parts, without voids, those that are inside out, too; 1 is one piece.
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

    Raises
    ------
    ParameterError
        Something else than a solid and a plate.
    """
    check_kind("solid", solid, Solid, "make_solid")
    check_kind("params", params, PlateParams)
    vertices, faces = solid.vertices, solid.faces
    watertight, oriented = edges_paired(faces)
    a, b, c = vertices[faces].transpose(1, 0, 2)
    normals = np.cross(b - a, c - a) / 2.0
    area = np.linalg.norm(normals, axis=1)
    _, share, walls = walls_sampled(solid)
    volumes, turned = _volumes(vertices, faces, params.nozzle_mm**3)
    values: dict[str, Any] = {
        "size_mm": tuple(float(length) for length in solid.size),
        "volume_mm3": solid.volume,
        "area_mm2": float(area.sum()),
        "triangles": len(faces),
        "watertight": watertight,
        "oriented": oriented,
        "bodies": len(volumes),
        "back_deviation_mm": back_deviation(vertices, faces, normals, params),
        "overlap_share": overlap_share(vertices, faces),
        "thinnest_mm": quantile(walls, share, 1e-3),
        "thin_area_mm2": float(share[walls < params.min_wall_mm].sum()),
        "overhang_area_mm2": overhang_area(vertices, faces, normals, area, params),
        "counts": dict(solid.counts),
    }
    failures = _failures(values, params, oriented and turned == 0)
    warnings = _warnings(values, params, sum(volumes[:-1]))
    verdict = "fail" if failures else "warnings" if warnings else "pass"
    return SolidReport(verdict=verdict, failures=failures, warnings=warnings, **values)


def _volumes(vertices: NDArray[np.float64], faces: NDArray[np.int64], drop: float) -> tuple[list[float], int]:
    """Return the volumes of the connected parts, the largest last, and how many of them are inside out.

    Voids are left out: they are inside out, too, but lie in a part. So are those smaller than a drop from
    the nozzle, which are as good as nothing.
    """
    a, b, c = vertices[faces].transpose(1, 0, 2)
    label = bodies(faces)
    volumes = np.bincount(label, weights=np.einsum("ij,ij->i", a, np.cross(b, c)) / 6.0)
    turned = [
        number
        for number in np.flatnonzero(volumes <= -drop)
        if winding_number(vertices[faces[label == number][0]].mean(axis=0), vertices, faces[label != number])
        < 0.5
    ]
    found = np.sort(np.concatenate([volumes[volumes > 0.0], -volumes[turned]]))
    return [float(volume) for volume in found], len(turned)


def _failures(values: dict[str, Any], params: PlateParams, outward: bool) -> tuple[str, ...]:
    failures = []
    if not values["watertight"]:
        failures.append("The mesh is not watertight: there are edges without exactly two faces.")
    if not outward:
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


def _warnings(values: dict[str, Any], params: PlateParams, loose_mm3: float) -> tuple[str, ...]:
    warnings = []
    if values["bodies"] > 1:
        warnings.append(
            f"{values['bodies'] - 1} parts touch nothing, {loose_mm3:.0f} mm3 in all{_ADVICE[params.loose]}."
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
