"""Draw the pictures of scans in the README: python data_scripts/make_scan_pictures.py SCANS [DIR].

SCANS is a folder with two public scans: scan_lion_rgb_normals.ply (the Takanawa lion of Potree) and
scan_bun000_raw_range.ply (bun000.ply of the Stanford bunny).
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import open3d as o3d
from numpy.typing import NDArray
from PIL import Image

import o3d_relief as rel
from o3d_relief.scan_records import SurfaceStage
from o3d_relief.scene.frame import relief_frame
from o3d_relief.show.easel import Easel
from o3d_relief.show.render import render, view_direction
from o3d_relief.show.scan_panels import SCAN_PANELS
from o3d_relief.show.sheets import contact_sheet

PANEL = (400, 440)
SCANS = {
    "lion": ("scan_lion_rgb_normals.ply", rel.View(front="-y", up="z")),
    "bunny": ("scan_bun000_raw_range.ply", rel.View()),
}


def sheet(scan: rel.Scan, relief: o3d.geometry.TriangleMesh, view: rel.View) -> NDArray[np.uint8]:
    """Draw the points, what Poisson makes of them, the mesh, and the relief from two sides."""
    frame = relief_frame(np.asarray(scan.mesh.vertices), view.front, view.up)
    easel = Easel(stages=scan.stages, size=PANEL)
    surface = scan.stages["surface"]
    assert isinstance(surface, SurfaceStage)
    whole = o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector(surface.vertices.copy()),
        o3d.utility.Vector3iVector(surface.faces.astype(np.int32)),
    )
    side = view_direction(50.0, 8.0)
    to_frame = np.linalg.inv(frame.to_scene)
    meshes = [o3d.geometry.TriangleMesh(mesh).transform(to_frame) for mesh in (whole, scan.mesh)]
    pictures = [
        SCAN_PANELS["points"](easel)[0],
        render(meshes[0], size=PANEL, direction=side),
        render(meshes[1], size=PANEL, direction=side),
        render(relief, size=PANEL, plate=True),
        render(relief, size=PANEL, direction=side, plate=True),
    ]
    titles = ["points", "closed surface", "mesh", "relief", "from the side"]
    return contact_sheet(pictures, len(pictures), titles=titles)


def main() -> None:
    """Draw both."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scans", type=Path)
    parser.add_argument("directory", type=Path, nargs="?", default=Path("docs"))
    options = parser.parse_args()
    for name, (file, view) in SCANS.items():
        scan = rel.scan_points(rel.read_points(options.scans / file), view=view)
        relief = rel.make_relief(scan.mesh, view=view)
        path = options.directory / f"scan_{name}.jpg"
        Image.fromarray(sheet(scan, relief.mesh, view)).save(path, quality=82, optimize=True)
        print(path)


if __name__ == "__main__":
    main()
