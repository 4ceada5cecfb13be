"""Draw the pictures of the README: python data_scripts/make_readme_pictures.py [DIR]."""

from __future__ import annotations

import argparse
import runpy
import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

import o3d_relief as rel
from o3d_relief.show.render import render, view_direction
from o3d_relief.show.sheets import contact_sheet, stage_picture, view_sheet

Picture = NDArray[np.uint8]

PANEL = (460, 460)
EXAMPLES = Path(__file__).resolve().parent.parent / "examples"


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
    perspectives = {name: make(view=rel.View(vanishing_point=g)) for name, g in points.items()}
    save(folder / "vanishing_point.jpg", views(perspectives, 0))
    figure(folder / "bas_relief.jpg", "figure_12_bas_relief")
    figure(folder / "gallery.jpg", "figure_13_gallery")
    figure(folder / "restoration.jpg", "figure_09_restoration")


if __name__ == "__main__":
    main()
