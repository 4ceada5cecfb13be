"""Height fields: the picture of depths that bas-relief methods work on, and the mesh that they give."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from o3d_relief.rays import unit_box

__all__ = ["HeightField", "sample"]


@dataclass(frozen=True, kw_only=True, eq=False)
class HeightField:
    """Heights on a square grid.

    Attributes
    ----------
    x, y : (columns,), (rows,) float64
        Places of the samples.
    z : (rows, columns) float64
        NaN where there is nothing.
    step : float
        Distance of neighbouring samples.
    """

    x: NDArray[np.float64]
    y: NDArray[np.float64]
    z: NDArray[np.float64]
    step: float

    def triangulate(self) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Return vertices (n, 3) and faces (m, 3), two a cell, one where a corner is missing."""
        there = np.isfinite(self.z)
        x, y = np.meshgrid(self.x, self.y)
        vertices = np.column_stack([x[there], y[there], self.z[there]])
        number = np.where(there, np.cumsum(there).reshape(there.shape) - 1, -1)
        cells = np.stack([number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]], axis=-1)
        corners = cells.reshape(-1, 4)
        present = corners >= 0
        whole = corners[present.all(axis=1)]
        three = corners[present.sum(axis=1) == 3]
        partial = three[three >= 0].reshape(-1, 3)  # in the order around the cell
        return vertices, np.concatenate([whole[:, [0, 1, 2]], whole[:, [0, 2, 3]], partial])


def sample(vertices: NDArray[np.float64], faces: NDArray[np.int64], *, side: int = 512) -> HeightField:
    """Sample what is visible of a mesh from the front, from z+.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int64
    side : int
        Samples along the longer of x and y.
    """
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    step = float((high - low)[:2].max()) / side
    x, y = (
        start + (np.arange(np.ceil((end - start) / step)) + 0.5) * step
        for start, end in zip(low[:2], high[:2], strict=True)
    )
    scene, middle, size = unit_box(vertices, faces)
    above = high[2] + 0.01 * size
    places = np.stack([*np.meshgrid(x, y), np.full((len(y), len(x)), above)], axis=-1)
    rays = np.zeros((*places.shape[:2], 6), dtype=np.float32)
    rays[..., :3] = (places - middle) / size
    rays[..., 5] = -1.0
    distance = scene.cast_rays(o3d.core.Tensor(rays))["t_hit"].numpy().astype(np.float64)
    return HeightField(
        x=x, y=y, z=np.where(np.isfinite(distance), above - distance * size, np.nan), step=step
    )
