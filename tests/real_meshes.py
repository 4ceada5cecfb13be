"""The real meshes, and the relief of each with default parameters: made once for all tests that want it."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import o3d_relief as rel

VIEWS = {
    "broken_chair.obj": ("z", "y"),
    "bunny_zipper.ply": ("z", "y"),
    "bust_igea.ply": ("z", "y"),
    "dragon_full_871k.ply": ("z", "y"),
    "dragon_res2.ply": ("z", "y"),
    "gargoyle_vertexcolor.ply": ("z", "y"),
    "igea_tristrips_original.ply": ("z", "y"),
    "lucy_100k.ply": ("y", "z"),
    "robot_steampunk_textured.glb": ("z", "y"),
    "scene_japanese_temple.obj": ("z", "y"),
    "scene_macross_city.glb": ("z", "y"),
    "statue_penelope.ply": ("z", "y"),
}
"""Where each mesh faces and stands."""


def real_view(name: str) -> rel.View:
    front, up = VIEWS[name]
    return rel.View(front=front, up=up)


@cache
def real_relief(folder: Path, name: str) -> rel.Relief:
    return rel.make_relief(rel.read_mesh(folder / name), view=real_view(name))
