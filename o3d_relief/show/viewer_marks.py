"""What the stage viewer shows beside the surface: points, wireframe, plane, caption."""

from __future__ import annotations

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from o3d_relief.records import AttenuationStage
from o3d_relief.show.annotate import write
from o3d_relief.show.live_mesh import DIMMED
from o3d_relief.show.scene_panels import ACTIONS

__all__ = ["Caption", "plane_outline", "point_balls", "point_lines", "wireframe"]

Legend = tuple[tuple[tuple[float, float, float], str], ...]

_BALL = 0.9  # relief units
_MANY_EDGES = 30_000
_CELLS = 60
"""A scene of more edges is drawn over a grid of so many cells along its longest side."""
_PAPER = 250


def plane_outline(bounds: NDArray[np.float64]) -> o3d.geometry.LineSet:
    """Return the outline of the relief plane around a box (2, 3)."""
    low, high = bounds[0, :2] - 3.0, bounds[1, :2] + 3.0
    corners = np.array([[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]])
    return _lines(
        np.column_stack([corners, np.zeros(4)]),
        np.array([[0, 1], [1, 2], [2, 3], [3, 0]]),
        (0.45, 0.45, 0.45),
    )


def wireframe(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> o3d.geometry.LineSet:
    """Return the edges of a scene, of a coarser copy where there are too many to see anything."""
    if 1.5 * len(faces) > _MANY_EDGES:
        mesh = o3d.geometry.TriangleMesh(
            o3d.utility.Vector3dVector(vertices.copy()), o3d.utility.Vector3iVector(faces.astype(np.int32))
        )
        coarse = mesh.simplify_vertex_clustering(float(np.ptp(vertices, axis=0).max()) / _CELLS)
        vertices, faces = np.asarray(coarse.vertices), np.asarray(coarse.triangles, dtype=np.int64)
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    return _lines(vertices, np.unique(np.sort(edges, axis=1), axis=0), (0.35, 0.45, 0.58))


def point_balls(record: AttenuationStage, surface: NDArray[np.float64]) -> o3d.geometry.TriangleMesh:
    """Return a ball at each attenuation point, where a surface (n, 3) has it, coloured by its action."""
    ball = o3d.geometry.TriangleMesh.create_sphere(_BALL, 6)
    vertices, faces = np.asarray(ball.vertices), np.asarray(ball.triangles)
    places = surface[record.index]
    start = np.arange(len(places))[:, None, None] * len(vertices)
    mesh = o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector((places[:, None] + vertices[None]).reshape(-1, 3)),
        o3d.utility.Vector3iVector((start + faces[None]).reshape(-1, 3).astype(np.int32)),
    )
    mesh.vertex_colors = o3d.utility.Vector3dVector(np.repeat(_colors(record), len(vertices), axis=0))
    mesh.compute_vertex_normals()
    return mesh


def point_lines(record: AttenuationStage, scene: NDArray[np.float64]) -> o3d.geometry.LineSet:
    """Return a line from the old to the new place of each attenuation point that has a new one."""
    kept = record.action != "discard"
    old = scene[record.index[kept]]
    new = np.column_stack([old[:, :2], record.new_height[kept]])
    number = np.arange(len(old))
    lines = _lines(np.concatenate([old, new]), np.column_stack([number, number + len(old)]), (0.0, 0.0, 0.0))
    lines.colors = o3d.utility.Vector3dVector(_colors(record)[kept])
    return lines


def _colors(record: AttenuationStage) -> NDArray[np.float64]:
    return np.array([ACTIONS[str(action)] for action in record.action]).reshape(-1, 3)


def _lines(
    points: NDArray[np.float64], pairs: NDArray[np.int64], color: tuple[float, float, float]
) -> o3d.geometry.LineSet:
    lines = o3d.geometry.LineSet(
        o3d.utility.Vector3dVector(points), o3d.utility.Vector2iVector(pairs.astype(np.int32))
    )
    lines.paint_uniform_color(color)
    return lines


class Caption:
    """A plate with writing under the relief: the window's title cannot be changed.

    Parameters
    ----------
    bounds : (2, 3) float
        Of the scene, in relief units.

    Attributes
    ----------
    mesh : open3d.geometry.TriangleMesh
    """

    _SIZE = (1800, 210)

    def __init__(self, bounds: NDArray[np.float64]) -> None:
        middle, width = float(bounds[:, 0].mean()), 100.0
        top = float(bounds[0, 1]) - 5.0
        left, right = middle - width / 2, middle + width / 2
        bottom = top - width * self._SIZE[1] / self._SIZE[0]
        corners = [(left, bottom, 0.0), (right, bottom, 0.0), (right, top, 0.0), (left, top, 0.0)]
        self.mesh = o3d.geometry.TriangleMesh(
            o3d.utility.Vector3dVector(np.array(corners)),
            o3d.utility.Vector3iVector(np.array([(0, 1, 2), (0, 2, 3)], dtype=np.int32)),
        )
        uvs = np.array([(0, 1), (1, 1), (1, 0), (0, 1), (1, 0), (0, 0)], dtype=np.float64)
        self.mesh.triangle_uvs = o3d.utility.Vector2dVector(uvs)
        self.mesh.triangle_material_ids = o3d.utility.IntVector(np.zeros(2, dtype=np.int32))
        self.mesh.compute_vertex_normals()
        self.say("", ())

    def say(self, title: str, legend: Legend) -> None:
        """Write a title and, below it, coloured squares with their words."""
        width, height = self._SIZE
        image = np.full((height, width, 3), _PAPER, dtype=np.uint8)
        letter = height // 3
        image = write(image, title, anchor="lm", x=20, y=0.28 * height, pixels=letter)
        x = 20.0
        for color, text in legend:
            square = slice(round(0.58 * height), round(0.88 * height)), slice(round(x), round(x) + letter)
            image[square] = np.rint(255.0 * np.array(color)).astype(np.uint8)
            image = write(image, text, anchor="lm", x=x + 1.3 * letter, y=0.73 * height, pixels=letter)
            x += (1.9 + 0.52 * len(text)) * letter
        self.mesh.textures = [o3d.geometry.Image(np.rint(DIMMED * image).astype(np.uint8))]
