"""Draw the pictures of the README: python data_scripts/make_readme_pictures.py [DIR]."""

from __future__ import annotations

import argparse
import runpy
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import open3d as o3d
from numpy.typing import NDArray
from PIL import Image

import o3d_relief as rel
from o3d_relief.making import wall_picture
from o3d_relief.show.render import render, view_direction
from o3d_relief.show.sheets import contact_sheet, stage_picture, view_sheet
from o3d_relief.solid.estimate import relief_depth

Picture = NDArray[np.uint8]

PANEL = (460, 460)
EXAMPLES = Path(__file__).resolve().parent.parent / "examples"
SMALL = (400, 400)


def save(path: Path, picture: Picture) -> None:
    """Write a picture as JPEG: a README is read over networks."""
    Image.fromarray(picture).save(path, quality=87, optimize=True)
    print(path)


def views(reliefs: dict[str, rel.Relief], yaw: float) -> Picture:
    """Draw reliefs side by side from one side, in one frame."""
    boxes = [(r.mesh.get_min_bound(), r.mesh.get_max_bound()) for r in reliefs.values()]
    low = np.min([box[0] for box in boxes], axis=0)
    high = np.max([box[1] for box in boxes], axis=0)
    pictures = [
        render(r.mesh, direction=view_direction(yaw), size=PANEL, plate=True, bounds=np.array([low, high]))
        for r in reliefs.values()
    ]
    titles = [
        f"{name}   depth {r.report()['relief_depth'] / r.stages['scene'].unit:.0f}"
        for name, r in reliefs.items()
    ]
    return contact_sheet(pictures, len(pictures), titles=titles)


def figure(path: Path, example: str) -> None:
    """Let an example draw its figure of the built-in scene."""
    with tempfile.TemporaryDirectory() as folder:
        drawn = Path(folder) / "figure.png"
        runpy.run_path(str(EXAMPLES / f"{example}.py"))["main"](output=str(drawn), panel=360)
        save(path, np.array(Image.open(drawn).convert("RGB")))


def section(solid: rel.Solid, x: float) -> Picture:
    """Cut a solid at an x and draw what lies right of it, the cut in red."""
    half = solid.to_manifold().trim_by_plane((1.0, 0.0, 0.0), x).to_mesh64()
    vertices = np.asarray(half.vert_properties)[:, :3]
    faces = np.asarray(half.tri_verts).astype(np.int32)
    cut = (np.abs(vertices[faces, 0] - x) < 1e-9).all(axis=1)
    faces[cut] += len(vertices)
    mesh = o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector(np.concatenate([vertices, vertices])), o3d.utility.Vector3iVector(faces)
    )
    colors = np.repeat([(0.83, 0.81, 0.78), (0.72, 0.22, 0.14)], len(vertices), axis=0)
    return render(mesh, direction=view_direction(-62, 12), size=SMALL, colors=colors, sharp_colors=True)


def solids(scene: o3d.geometry.TriangleMesh) -> Picture:
    """Draw a solid on three plates, cut open, and from behind."""

    def make(**values: Any) -> rel.Solid:
        plate = rel.PlateParams(width_mm=150, depth_mm=32, base_mm=5, **values)
        depth = relief_depth(scene, rel.View(), plate)
        return rel.make_solid(rel.make_relief(scene, rel.ReliefParams(depth=depth)), plate)

    plain, ellipse = make(), make(shape="ellipse", frame_mm=4.0, margin_mm=3.0)
    contour = make(shape="contour", hanging="keyhole")
    views = [(plain, 35, 12), (ellipse, 35, 12), (contour, 35, 12), (contour, 180, 0)]
    pictures = [
        render(solid.to_open3d(), direction=view_direction(yaw, pitch), size=SMALL)
        for solid, yaw, pitch in views
    ]
    pictures.insert(3, section(plain, -14.0))
    pictures.append(wall_picture(make(shape="contour"), rel.PlateParams(), size=SMALL)[:, : SMALL[0]])
    titles = ["rectangle", "ellipse with a frame", "contour", "cut open", "keyhole", "walls under 0.8 mm"]
    return contact_sheet(pictures, 3, titles=titles)


def milling(solid: rel.Solid) -> Picture:
    """Draw a solid, what a mill makes of it, and the height map."""
    params = rel.MillParams(mm_per_pixel=0.2, tool_mm=3.0, draft_deg=3.0)
    field = rel.milled(rel.height_field(solid, params.mm_per_pixel), params)
    pictures = [
        render(made.to_open3d(), direction=view_direction(35), size=PANEL, crease=30.0)
        for made in (solid, rel.solid_under(field, solid))
    ]
    grey = Image.fromarray(
        np.nan_to_num(255.0 * (field.z - field.back) / (field.highest - field.back)).astype(np.uint8)
    )
    sheet = Image.new("L", PANEL, 222)
    grey.thumbnail((PANEL[0] - 40, PANEL[1] - 40))
    sheet.paste(grey, tuple((all_of - mine) // 2 for all_of, mine in zip(PANEL, grey.size, strict=True)))
    pictures.append(np.asarray(sheet.convert("RGB")))
    return contact_sheet(pictures, 3, titles=["solid", "without undercuts, tool 3 mm", "height map"])


def tiles(solid: rel.Solid) -> Picture:
    """Draw tiles laid apart, from the front and from behind."""
    apart = o3d.geometry.TriangleMesh()
    for tile in rel.make_tiles(solid, rel.TileParams(width_mm=170, height_mm=170)).tiles:
        apart += tile.solid.to_open3d().translate((18.0 * tile.column, -18.0 * tile.row, 0.0))
    pictures = [
        render(apart, direction=direction, light=light, size=PANEL, crease=30.0)
        for direction, light in (
            ((0.6, 0.35, 1.0), (-0.55, 0.65, 0.6)),
            ((0.25, 0.2, -1.0), (0.8, 0.5, -0.3)),
        )
    ]
    return contact_sheet(pictures, 2, titles=["tiles", "their backs"])


def main() -> None:
    """Draw all pictures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("directory", type=Path, nargs="?", default=Path("docs"))
    folder = parser.parse_args().directory
    folder.mkdir(parents=True, exist_ok=True)
    scene = rel.demo_scene()

    def make(view: rel.View | None = None, **params: float) -> rel.Relief:
        return rel.make_relief(scene, rel.ReliefParams(**params), view=view)

    relief = make(alpha=0.8)
    placed = rel.demo_scene().transform(np.linalg.inv(relief.to_scene))
    save(folder / "sheet.jpg", view_sheet(placed, relief.mesh, panel=PANEL))
    for name in ("clusters", "attenuation", "restoration"):
        save(folder / f"stage_{name}.jpg", stage_picture(name, relief.stages, relief=relief.mesh))
    save(folder / "k.jpg", views({f"k = {k}": make(k=k) for k in (1, 16, 128, 512)}, 50))
    save(folder / "beta.jpg", views({f"beta = {b}": make(beta=b) for b in (0.02, 0.2, 2.0)}, 50))
    ratios: dict[str, dict[str, float]] = {
        "k = 1, alpha = 0.3": {"k": 1, "alpha": 0.3},
        "k = 128, no alpha": {},
        "k = 128, alpha = 0.8": {"alpha": 0.8},
        "k = 128, alpha = 0.4": {"alpha": 0.4},
    }
    save(folder / "alpha.jpg", views({name: make(**values) for name, values in ratios.items()}, 50))
    points = {"none": None, "g = (0, 0, -300)": (0.0, 0.0, -300.0), "g = (0, 0, -80)": (0.0, 0.0, -80.0)}
    save(folder / "solid.jpg", solids(scene))
    perspectives = {name: make(view=rel.View(vanishing_point=g)) for name, g in points.items()}
    save(folder / "vanishing_point.jpg", views(perspectives, 0))
    figure(folder / "bas_relief.jpg", "figure_12_bas_relief")
    figure(folder / "gallery.jpg", "figure_13_gallery")
    save(folder / "milling.jpg", milling(rel.make_solid(make(), rel.PlateParams(width_mm=150, depth_mm=29))))
    large = rel.PlateParams(width_mm=260, depth_mm=48, base_mm=8)
    save(folder / "tiles.jpg", tiles(rel.make_solid(make(), large)))


if __name__ == "__main__":
    main()
