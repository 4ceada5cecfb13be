"""Compare methods on real meshes at the same depth: python benchmarks/quality.py FOLDER [OUTPUT] [options].

FOLDER holds the meshes and a MANIFEST.tsv with the columns `file`, `suggested_view_from` and `up`. The
tables go to standard output and, with every number in quality.json and a sheet of pictures per mesh, to
OUTPUT. Numbers that OUTPUT/quality.json has already are kept; delete the file to measure anew.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

import o3d_relief as rel
from baselines.cignoni import depth_compression
from baselines.height_field import sample
from baselines.linear import linear_scaling
from baselines.schueller import appearance_mimicking
from baselines.weyrich import bas_relief
from manifest import row_of
from o3d_relief.measure import Yardstick
from o3d_relief.scene.convert import arrays_mesh
from o3d_relief.scene.frame import relief_frame, to_relief_units
from o3d_relief.scene.weld import weld
from o3d_relief.stages.trim import trim_behind
from o3d_relief.stages.visibility import visible_vertices

MESHES = (
    "statue_penelope.ply",
    "gargoyle_vertexcolor.ply",
    "lucy_100k.ply",
    "bunny_zipper.ply",
    "dragon_res2.ply",
    "bust_igea.ply",
    "robot_steampunk_textured.glb",
    "scene_japanese_temple.obj",
    "scene_macross_city.glb",
)
SHARES = (0.5, 0.25, 0.1)
SHEET_SHARE = 0.25
SHEET_YAWS = (0.0, 20.0, 40.0)
SHEET_PANEL = (420, 420)
MANY_PARTS = ("scene_macross_city.glb",)  # thousands of parts: no order, which takes minutes, and no program
AXES = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1)}

Arrays = tuple[NDArray[np.float64], NDArray[np.int64]]


@dataclass(frozen=True, kw_only=True, eq=False)
class Scene:
    """A welded scene in relief units, in the relief frame."""

    name: str
    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    visible: NDArray[np.bool_]

    @property
    def many_parts(self) -> bool:
        """Whether what takes minutes for each part is left out."""
        return self.name in MANY_PARTS


@dataclass(frozen=True, kw_only=True, eq=False)
class Made:
    """A relief: its mesh, and the new z of each vertex of the scene where there is one."""

    mesh: Arrays
    heights: NDArray[np.float64] | None = None


def moved(scene: Scene, heights: NDArray[np.float64]) -> Made:
    """Move the vertices of the scene and cut at S."""
    places = np.column_stack([scene.vertices[:, :2], heights])
    # Rounding errors around zero would leave slivers at the cut.
    places[np.abs(places[:, 2]) < 1e-9, 2] = 0.0
    cut = trim_behind(places, scene.faces, np.ones(len(places), dtype=bool))
    return Made(mesh=(cut.vertices, cut.faces), heights=heights)


def made_here(scene: Scene, params: rel.ReliefParams, last: str) -> Made:
    """Make a relief with this package; the stage `last` has the new heights."""
    relief = rel.make_relief(arrays_mesh(scene.vertices, scene.faces), params)
    stages: Any = relief.stages
    mesh = np.asarray(relief.mesh.vertices), np.asarray(relief.mesh.triangles).astype(np.int64)
    return Made(mesh=mesh, heights=stages[last].z * stages["scene"].unit)


def attenuation(scene: Scene, depth: float) -> Made:
    """Run the paper's method, with what the package adds to it and compressed to the depth."""
    params = rel.ReliefParams(mode="attenuation", k=128, depth=depth, in_order=not scene.many_parts)
    return made_here(scene, params, "compression")


def mimicking(scene: Scene, depth: float) -> Made | None:
    """Solve for the appearance-mimicking surface, on scenes that a quadratic program can take."""
    if scene.many_parts:
        return None
    return moved(scene, appearance_mimicking(scene.vertices, scene.faces, scene.visible, depth))


METHODS: dict[str, Callable[[Scene, float], Made | None]] = {
    "linear": lambda scene, depth: moved(scene, linear_scaling(scene.vertices[:, 2], scene.visible, depth)),
    "Cignoni": lambda scene, depth: moved(
        scene, depth_compression(scene.vertices[:, 2], scene.visible, depth)
    ),
    "Weyrich": lambda scene, depth: Made(
        mesh=bas_relief(sample(scene.vertices, scene.faces), depth).triangulate()
    ),
    "Schueller": mimicking,
    "attenuation": attenuation,
    "bounded": lambda scene, depth: made_here(
        scene, rel.ReliefParams(mode="bounded", depth=depth), "bounded"
    ),
}


def read_scene(folder: Path, name: str) -> Scene:
    """Read a mesh, turn it as the manifest says and weld it."""
    row = row_of(folder, name)
    side = row["suggested_view_from"].split()[0]  # "z+", or "z+ (3/4 better)"
    front = np.array(AXES[side[0]]) * (-1 if side[1] == "-" else 1)
    mesh = rel.read_mesh(folder / name)
    vertices, faces = np.array(mesh.vertices), np.array(mesh.triangles, dtype=np.int64)
    frame = relief_frame(vertices[np.unique(faces)], front, AXES[row["up"]])
    welded = weld(to_relief_units(vertices, frame, on_grid=True), faces)
    visible = visible_vertices(welded.vertices, welded.faces)
    return Scene(name=name, vertices=welded.vertices, faces=welded.faces, visible=visible)


def run(scene: Scene, share: float, method: str, yardstick: Yardstick) -> tuple[dict[str, Any], Made | None]:
    """Make and measure one relief."""
    depth = share * yardstick.scene_depth
    row: dict[str, Any] = {"mesh": scene.name, "share": share, "method": method, "quality": None}
    started = time.process_time()
    made = METHODS[method](scene, depth)
    row["seconds"] = time.process_time() - started
    if made is not None:
        quality = yardstick.measure(made.mesh, heights=made.heights, similarity=True)
        row["quality"] = asdict(quality) | {"wanted": depth, "mean_angle": quality.mean_angle}
    return row, made


def sheet(scene: Scene, made: dict[str, Made]) -> NDArray[np.uint8]:
    """Draw the scene and its reliefs from three sides, in one light and at one scale."""
    reliefs = {name: arrays_mesh(*one.mesh) for name, one in made.items()}
    meshes = {"scene": arrays_mesh(scene.vertices, scene.faces)} | reliefs
    return rel.comparison_sheet(meshes, SHEET_YAWS, plates=reliefs, panel=SHEET_PANEL)


def angle_table(rows: list[dict[str, Any]]) -> str:
    """Write the angles of all meshes, depths and methods as a table in Markdown."""
    methods = [name for name in METHODS if any(row["method"] == name for row in rows)]
    lines = [
        "| mesh | depth | " + " | ".join(methods) + " |",
        "|---|---|" + "---|" * len(methods),
    ]
    cells = {(row["mesh"], row["share"], row["method"]): row["quality"] for row in rows}
    for mesh, share in dict.fromkeys((row["mesh"], row["share"]) for row in rows):
        found = [cells.get((mesh, share, method)) for method in methods]
        values = [
            [None if one is None else round(one["normal_angles"][0], 1) for one in found],
            [None if one is None else round(one["mean_angle"], 1) for one in found],
        ]
        best = [min(value for value in part if value is not None) for part in values]
        texts = [
            "–" if front is None else f"{_bold(front, best[0])} / {_bold(mean, best[1])}"
            for front, mean in zip(*values, strict=True)
        ]
        lines.append(f"| {Path(mesh).stem} | {share:.0%} | " + " | ".join(texts) + " |")
    return "\n".join(lines)


def _bold(value: float, best: float) -> str:
    return f"**{value:.1f}**" if value == best else f"{value:.1f}"


def summary_table(rows: list[dict[str, Any]]) -> str:
    """Write what else was measured, over all meshes, as a table in Markdown."""
    lines = [
        "| method | depth | angle, front | angle, seven views | SSIM, front | SSIM, seven views | "
        "silhouettes | discontinuities kept | pairs inverted | visible behind S | depth reached | "
        "CPU s, median |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for method in METHODS:
        for share in dict.fromkeys(row["share"] for row in rows):
            mine = [
                row for row in rows if (row["method"], row["share"]) == (method, share) and row["quality"]
            ]
            if not mine:
                continue
            q = [row["quality"] for row in mine]
            reached = [one["depth"] / one["wanted"] for one in q]
            lines.append(
                f"| {method} | {share:.0%} | {np.mean([one['normal_angles'][0] for one in q]):.1f} | "
                f"{np.mean([one['mean_angle'] for one in q]):.1f} | "
                f"{np.mean([one['similarities'][0] for one in q]):.2f} | "
                f"{np.mean([np.mean(one['similarities']) for one in q]):.2f} | "
                f"{np.mean([np.mean(one['silhouette_overlaps']) for one in q]):.2f} | "
                f"{np.nanmean([one['discontinuities_kept'] for one in q]):.0%} | "
                f"{_sum(q, 'order_inversions')} | {_sum(q, 'visible_behind')} | "
                f"{_range(reached)} | {np.median([row['seconds'] for row in mine]):.1f} |"
            )
    return "\n".join(lines)


def _sum(quality: list[dict[str, Any]], name: str) -> str:
    known = [one[name] for one in quality if one[name] is not None]
    return f"{sum(known)}" if known else "–"


def _range(reached: list[float]) -> str:
    low, high = f"{min(reached):.1%}", f"{max(reached):.1%}"
    return low if low == high else f"{low} to {high}"


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("output", type=Path, nargs="?", default=Path("quality"))
    parser.add_argument("--meshes", nargs="+", default=MESHES, metavar="FILE")
    parser.add_argument(
        "--shares", nargs="+", type=float, default=SHARES, help="of the scene's visible depth"
    )
    parser.add_argument("--methods", nargs="+", default=list(METHODS), choices=METHODS)
    parser.add_argument("--size", type=int, default=400, help="of the pictures that are compared, in pixels")
    parser.add_argument("--no-sheets", action="store_true", help="draw no sheets")
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    kept = options.output / "quality.json"
    rows: list[dict[str, Any]] = json.loads(kept.read_text(encoding="utf-8")) if kept.exists() else []
    known = {(row["mesh"], row["share"], row["method"]) for row in rows}
    for mesh in options.meshes:
        wanted = [(share, method) for share in options.shares for method in options.methods]
        missing = [one for one in wanted if (mesh, *one) not in known]
        drawn = options.output / f"{Path(mesh).stem}.jpg"
        if not missing and (options.no_sheets or drawn.exists()):
            continue
        scene = read_scene(options.folder, mesh)
        yardstick = Yardstick((scene.vertices, scene.faces), size=options.size)
        made = {}
        for share, method in missing:
            row, relief = run(scene, share, method, yardstick)
            rows.append(row)
            kept.write_text(json.dumps(rows, indent=1), encoding="utf-8")
            if share == SHEET_SHARE and relief is not None:
                made[method] = relief
            angle = f"{row['quality']['mean_angle']:.1f}" if row["quality"] else "-"
            print(
                f"{mesh} {share:.0%} {method}: {angle}, {row['seconds']:.1f} s", file=sys.stderr, flush=True
            )
        if not options.no_sheets:
            reliefs = {}
            for method, make in METHODS.items():
                relief = made.get(method) or make(scene, SHEET_SHARE * yardstick.scene_depth)
                if relief is not None:
                    reliefs[method] = relief
            Image.fromarray(sheet(scene, reliefs)).save(drawn, quality=88, optimize=True)
    order = {mesh: number for number, mesh in enumerate(MESHES)}
    rows.sort(key=lambda row: (order.get(row["mesh"], len(order)), -row["share"]))
    tables = angle_table(rows) + "\n\n" + summary_table(rows) + "\n"
    (options.output / "quality.md").write_text(tables, encoding="utf-8")
    print(tables)


if __name__ == "__main__":
    main()
