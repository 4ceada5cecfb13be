"""Make solids of all meshes and scans of a folder: python benchmarks/solids.py [FOLDER] [--shapes ...].

FOLDER (default: the one that O3D_RELIEF_DATA names) may have a MANIFEST.tsv with the columns file, up and
suggested_view_from. Each relief is made at the depth that is asked for, each solid measured by trimesh, which
took no part in making it. A line for each, tab-separated; the seconds are those of
computing. The exit code is 1 if one is not as asked for.
"""

from __future__ import annotations

import argparse
import csv
import os
import sys
import time
from pathlib import Path

import numpy as np
import open3d as o3d
import trimesh

import o3d_relief as rel
from o3d_relief.plate_params import SHAPES
from o3d_relief.scene.arrays import MeshArrays, to_open3d
from o3d_relief.scene.read import READABLE, READABLE_CLOUDS, read_arrays
from o3d_relief.solid.checks import check_solid
from o3d_relief.solid.estimate import relief_depth

COLUMNS = [
    "file",
    "shape",
    "triangles",
    "watertight",
    "oriented",
    "volume_cm3",
    "size_mm",
    "size_off_mm",
    "back_off_mm",
    "bodies",
    "overlap",
    "thin_mm2",
    "closed",
    "capped",
    "to_plate",
    "filled",
    "thickened",
    "relief_s",
    "solid_s",
    "verdict",
]


def views(folder: Path) -> dict[str, rel.View]:
    """Return the view of each mesh or scan."""
    manifest = folder / "MANIFEST.tsv"
    if not manifest.exists():
        endings = READABLE + READABLE_CLOUDS
        return {path.name: rel.View() for path in sorted(folder.iterdir()) if path.suffix in endings}
    with manifest.open() as lines:
        rows = list(csv.DictReader(lines, delimiter="\t"))
    result = {}
    for row in rows:
        axis = row["suggested_view_from"].split()[0]
        result[row["file"]] = rel.View(front=axis.replace("+", "")[::-1], up=row["up"])
    return result


def read(path: Path, view: rel.View) -> o3d.geometry.TriangleMesh:
    """Read a mesh, or a scan as a mesh."""
    arrays = read_arrays(path)
    if isinstance(arrays, MeshArrays):
        return to_open3d(arrays)
    return rel.mesh_from_points(arrays.to_open3d(), view=view)


def row_of(name: str, solid: rel.Solid, params: rel.PlateParams, seconds: tuple[float, float]) -> list[str]:
    """Measure a solid."""
    report = check_solid(solid, params)
    mesh = trimesh.Trimesh(solid.vertices, solid.faces, process=False)
    off = max(abs(mesh.extents[0] - params.width_mm), abs(mesh.extents[2] - (params.depth_mm or 0.0)))
    back = np.abs(mesh.triangles[mesh.face_normals[:, 2] < -0.999][:, :, 2] + params.back_mm)
    back_off = back[(back < 0.1).all(axis=1)].max()
    good = mesh.is_watertight and mesh.is_winding_consistent and mesh.volume > 0
    good = good and off < 0.01 and back_off < 1e-6 and report.verdict != "fail"
    parts = [
        f"{solid.counts[f'parts_{how}']:.0f}"
        for how in ("closed", "capped", "to_the_plate", "filled", "thickened")
    ]
    return [
        name, params.shape, str(len(mesh.faces)), str(mesh.is_watertight), str(mesh.is_winding_consistent),
        f"{mesh.volume / 1000:.1f}", " x ".join(f"{length:.2f}" for length in mesh.extents), f"{off:.1e}",
        f"{back_off:.1e}", str(report.bodies), f"{report.overlap_share:.0e}",
        f"{report.thin_area_mm2:.0f}", *parts,
        f"{seconds[0]:.1f}", f"{seconds[1]:.1f}", report.verdict if good else "FAIL",
    ]  # fmt: skip


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, default=os.environ.get("O3D_RELIEF_DATA"))
    parser.add_argument("--shapes", nargs="+", choices=SHAPES, default=["rectangle", "contour"])
    parser.add_argument("--mode", choices=["attenuation", "bounded"], help="of the relief (default: bounded)")
    parser.add_argument("--only", nargs="+", metavar="NAME", help="files whose names contain one of these")
    options = parser.parse_args()
    if options.folder is None:
        parser.error("name a folder of meshes, or let O3D_RELIEF_DATA name it")
    print("\t".join(COLUMNS))
    failed = False
    for name, view in views(Path(options.folder)).items():
        if options.only and not any(word in name for word in options.only):
            continue
        mesh = read(Path(options.folder) / name, view)
        reliefs: dict[float | None, tuple[rel.Relief, float]] = {}
        for shape in options.shapes:
            params = rel.PlateParams(width_mm=150, depth_mm=25, shape=shape)
            depth = relief_depth(mesh, view, params)
            started = time.process_time()
            if depth not in reliefs:
                relief = rel.make_relief(mesh, rel.ReliefParams(depth=depth, mode=options.mode), view=view)
                reliefs[depth] = relief, time.process_time() - started
            relief, relief_seconds = reliefs[depth]
            started = time.process_time()
            solid = rel.make_solid(relief, params)
            row = row_of(name, solid, params, (relief_seconds, time.process_time() - started))
            failed |= row[-1] == "FAIL"
            print("\t".join(row), flush=True)
    sys.exit(int(failed))


if __name__ == "__main__":
    main()
