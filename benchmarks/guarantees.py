"""Test what is guaranteed, on real meshes: python benchmarks/guarantees.py FOLDER [OUTPUT] [options].

FOLDER holds the meshes and a MANIFEST.tsv with the columns `file`, `suggested_view_from` and `up`. Each
relief is made once with the guarantees and once as the paper has it, and everything is counted on the
finished mesh by its certificate. The seconds of the guarantees are those that come on top of the paper's.
Some of their work is done beside the rest: on the wall they are fewer where the machine is idle otherwise.
Each row is printed, and written to OUTPUT/guarantees.json, as it is made; rows that are there already are
kept, delete the file to measure anew.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import asdict
from pathlib import Path
from typing import Any

import open3d as o3d

import manifest
import o3d_relief as rel
from o3d_relief.scene.arrays import MeshArrays, to_open3d
from o3d_relief.scene.read import read_arrays

KS = (16, 64, 128, 256)
BETAS = (0.05, 0.2, 0.8)
BUILT_IN = "demo"

HEAD = (
    "| mesh | parts | k | beta | visible behind | inversions, vertices / grid | old | left | gaps missed | "
    "new crossings | bend near points / elsewhere | visible depth, scene / paper / relief | "
    "CPU s, paper / guarantees | wall s, paper / guarantees | certificate |\n" + "|---" * 15 + "|"
)


def read(folder: Path, name: str) -> tuple[o3d.geometry.TriangleMesh, rel.View] | None:
    """Read a mesh, and how it is looked at; `demo` is the built-in scene, a point cloud is None."""
    if name == BUILT_IN:
        return rel.demo_scene(), rel.View()
    arrays = read_arrays(folder / name)
    return (to_open3d(arrays), manifest.view_of(folder, name)) if isinstance(arrays, MeshArrays) else None


def timed(
    mesh: o3d.geometry.TriangleMesh, view: rel.View, params: rel.ReliefParams
) -> tuple[rel.Relief, float, float]:
    """Make a relief; return the CPU seconds and the seconds on the wall as well."""
    worked, started = time.process_time(), time.perf_counter()
    relief = rel.make_relief(mesh, params, view=view)
    return relief, time.process_time() - worked, time.perf_counter() - started


def run(
    mesh: o3d.geometry.TriangleMesh, view: rel.View, name: str, k: int, beta: float, min_gap: float
) -> dict[str, Any]:
    """Make one relief, and measure it; `min_gap` is in relief units."""
    row: dict[str, Any] = {"mesh": name, "k": k, "beta": beta, "min_gap": min_gap}
    try:
        paper, rest, rest_wall = timed(mesh, view, rel.ReliefParams.paper(k=k, beta=beta))
        unit = paper.stages["scene"].unit
        params = rel.ReliefParams(k=k, beta=beta, min_gap=min_gap * unit)
        relief, everything, everything_wall = timed(mesh, view, params)
    except rel.ReliefError as error:
        return row | {"error": str(error)}
    certificate = relief.certificate
    summary = relief.summary()
    return row | {
        "parts": relief.stages["construction"].counts["components"],
        "scene_depth": summary["scene_visible_depth"] / unit,
        "paper_depth": paper.summary()["relief_visible_depth"] / unit,
        "depth": summary["relief_visible_depth"] / unit,
        "left": relief.stages["order"].counts["left"],
        "rounds": relief.stages["order"].counts["rounds"],
        "rest_seconds": rest,
        "guarantee_seconds": everything - rest,
        "rest_wall_seconds": rest_wall,
        "guarantee_wall_seconds": everything_wall - rest_wall,
        "stage_seconds": {stage: record.seconds for stage, record in relief.stages.items()},
        "certificate": asdict(certificate),
        "failures": certificate.failures,
    }


def line(row: dict[str, Any]) -> str:
    """Write a row of the table in Markdown."""
    start = f"| {Path(row['mesh']).stem} | "
    if "error" in row:
        return f"{start}– | {row['k']} | {row['beta']:g} |" + " – |" * 10 + f" {row['error']} |"
    c = row["certificate"]
    return (
        f"{start}{row['parts']} | {row['k']} | {row['beta']:g} | {c['visible_behind']} | "
        f"{c['vertex_inversions']} / {c['grid_inversions']} | {c['old_inversions']} | {row['left']} | "
        f"{c['gaps_missed']} | {c['new_crossings']} | "
        f"{c['bend_near_points']:.1f} / {c['bend_elsewhere']:.1f} | "
        f"{row['scene_depth']:.1f} / {row['paper_depth']:.1f} / {row['depth']:.1f} | "
        f"{row['rest_seconds']:.1f} / {row['guarantee_seconds']:.1f} | "
        f"{row['rest_wall_seconds']:.1f} / {row['guarantee_wall_seconds']:.1f} | "
        f"{'clean' if not row['failures'] else 'fails'} |"
    )


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("output", type=Path, nargs="?", default=Path("guarantees"))
    parser.add_argument(
        "--meshes", nargs="+", metavar="FILE", help=f"default: {BUILT_IN} and all meshes of the folder"
    )
    parser.add_argument("--k", nargs="+", type=int, default=KS)
    parser.add_argument("--beta", nargs="+", type=float, default=BETAS)
    parser.add_argument("--min-gap", type=float, default=0.0, help="in relief units")
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    kept = options.output / "guarantees.json"
    rows: list[dict[str, Any]] = json.loads(kept.read_text(encoding="utf-8")) if kept.exists() else []
    known = {(row["mesh"], row["k"], row["beta"], row["min_gap"]): row for row in rows}
    rel.make_relief(rel.demo_scene(), rel.ReliefParams(k=4))  # the first call loads libraries
    print(HEAD, flush=True)
    for name in options.meshes or [BUILT_IN, *manifest.files(options.folder)]:
        scene = read(options.folder, name)
        if scene is None:
            continue
        for k in options.k:
            for beta in options.beta:
                row = known.get((name, k, beta, options.min_gap))
                if row is None:
                    row = run(*scene, name, k, beta, options.min_gap)
                    rows.append(row)
                    kept.write_text(json.dumps(rows, indent=1), encoding="utf-8")
                print(line(row), flush=True)


if __name__ == "__main__":
    main()
