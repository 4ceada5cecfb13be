"""How much of the angle from the side is due to places: python benchmarks/ceiling.py FOLDER [options].

From the side a flattened scene shows its surface at other places of the picture than the scene does. The
table tells what the mean angle over the seven views of `Yardstick` would be if a relief had every single
normal of its scene, and only the places of linear scaling. No relief has; it is what is left to win.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from baselines.linear import linear_scaling
from o3d_relief.measure import SEVEN_VIEWS
from o3d_relief.show.camera import view_direction
from o3d_relief.show.shots import Body, Shot, normal_angle
from quality import MESHES, Scene, read_scene

SHARES = (0.25, 0.1)


def in_front(relief: Body, view: tuple[float, float], reach: NDArray[np.float64], size: int) -> Shot:
    """Take a shot of what of a relief that is not cut yet lies in front of S."""
    shot, camera = relief.shoot(view, reach, size), relief.camera(view, reach, size)
    pixels = np.arange(size) + 0.5
    across = (pixels[None, :] - camera.middle[0]) / camera.scale
    above = (camera.middle[1] - pixels[:, None]) / camera.scale
    z = camera.center[2] + np.tensordot(
        camera.axes[:, 2], np.array(np.broadcast_arrays(across, above, shot.height)), 1
    )
    return replace(shot, hit=shot.hit & (z > 0.0))


def carried(shot: Shot, normals: NDArray[np.float64], view: tuple[float, float]) -> Shot:
    """Give what is hit the normals (m, 3) of its triangles, turned to the camera."""
    normal = normals[shot.face]
    normal = normal * np.where(normal @ view_direction(*view) < 0.0, -1.0, 1.0)[..., None]
    return replace(shot, normal=normal.astype(np.float32))


def angles(scene: Scene, share: float, size: int) -> NDArray[np.float64]:
    """Return the angles of linear scaling, and of the scene's normals at its places, in each view (2, v)."""
    corners = scene.vertices[scene.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1), np.finfo(np.float64).tiny)[:, None]
    middle = (scene.vertices.min(axis=0) + scene.vertices.max(axis=0))[:2] / 2
    body = Body(scene.vertices, scene.faces, middle)
    reach = np.abs(scene.vertices - body.target).max(axis=0)
    heights = linear_scaling(scene.vertices[:, 2], scene.visible, share * body.depth)
    relief = Body(np.column_stack([scene.vertices[:, :2], heights]), scene.faces, middle)
    found = []
    for view in SEVEN_VIEWS:
        before, linear = body.shoot(view, reach, size), in_front(relief, view, reach, size)
        found.append([normal_angle(before, linear), normal_angle(before, carried(linear, normals, view))])
    return np.transpose(found)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("--meshes", nargs="+", default=MESHES, metavar="FILE")
    parser.add_argument(
        "--shares", nargs="+", type=float, default=SHARES, help="of the scene's visible depth"
    )
    parser.add_argument("--size", type=int, default=400, help="of the pictures that are compared, in pixels")
    options = parser.parse_args()
    print("| mesh | depth | linear | all of the scene's normals | below linear |")
    print("|---|---|---|---|---|")
    for mesh in options.meshes:
        scene = read_scene(options.folder, mesh)
        for share in options.shares:
            linear, best = angles(scene, share, options.size).mean(axis=1)
            print(
                f"| {Path(mesh).stem} | {share:.0%} | {linear:.1f} | {best:.1f} | {1 - best / linear:.0%} |"
            )


if __name__ == "__main__":
    main()
