"""The colour of a surface before any light falls on it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from o3d_relief.show.colors import apply_colormap, to_linear
from o3d_relief.show.surface import Surface

__all__ = ["PLASTER", "Paint"]

PLASTER = (0.825, 0.803, 0.768)
"""sRGB colour of a mesh without colours of its own: a warm, light grey."""

_PLATE = (0.80, 0.785, 0.76)


@dataclass(frozen=True, kw_only=True, eq=False)
class Paint:
    """What a mesh is painted with.

    Attributes
    ----------
    colors : (n, 3) float32 or None
        Linear light at the vertices, instead of the mesh's own colours and textures.
    sharp : bool
        A point takes the colour of the nearest corner instead of a blend.
    field : (n,) float64 or None
        Numbers instead of colours, drawn through `colormap` over `field_range`.
    colormap : str
    field_range : (low, high)
    plate_from : int or None
        The faces from this one on are the plate, which is never painted.
    """

    colors: NDArray[np.float32] | None = None
    sharp: bool = False
    field: NDArray[np.float64] | None = None
    colormap: str = "viridis"
    field_range: tuple[float, float] = (0.0, 1.0)
    plate_from: int | None = None

    def albedo(
        self, surface: Surface, face: NDArray[np.int64], weights: NDArray[np.float32]
    ) -> NDArray[np.float32]:
        """Return the linear colour (h, 3) at points given by face (h,) and barycentric weights (h, 3)."""
        if self.plate_from is not None:
            color = np.tile(to_linear(_PLATE), (len(face), 1))
            mesh = face < self.plate_from
            color[mesh] = self._mesh_albedo(surface, face[mesh], weights[mesh])
            return color
        return self._mesh_albedo(surface, face, weights)

    def _mesh_albedo(
        self, surface: Surface, face: NDArray[np.int64], weights: NDArray[np.float32]
    ) -> NDArray[np.float32]:
        if self.sharp:
            weights = np.eye(3, dtype=np.float32)[np.argmax(weights, axis=1)]
        corners = surface.faces[face]
        if self.field is not None:
            values = _blend(self.field[corners], weights.astype(np.float64))
            return to_linear(apply_colormap(values, self.colormap, self.field_range))
        if self.colors is not None:
            return np.asarray(np.einsum("hcj,hc->hj", self.colors[corners], weights))
        if surface.vertex_colors is None and surface.corner_uvs is None:
            return np.tile(to_linear(PLASTER), (len(face), 1))
        color = np.ones((len(face), 3), dtype=np.float32)
        if surface.vertex_colors is not None:
            color = np.einsum("hcj,hc->hj", surface.vertex_colors[corners], weights)
        if surface.corner_uvs is not None and surface.texture_index is not None:
            uv = np.einsum("hcj,hc->hj", surface.corner_uvs[face], weights)
            chosen = surface.texture_index[face]
            for number, texture in enumerate(surface.textures):
                here = chosen == number
                if np.any(here):
                    color[here] *= _sample(texture, uv[here])
        return color


def _blend(values: NDArray[np.float64], weights: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the weighted sum of corner values; corners without weight may be NaN."""
    return np.asarray(np.where(weights > 0.0, values * weights, 0.0).sum(axis=1))


def _sample(texture: NDArray[np.float32], uv: NDArray[np.float32]) -> NDArray[np.float32]:
    """Read a repeating texture between its pixels; the first row lies at v = 0."""
    height, width = texture.shape[:2]
    uv = np.where(np.isfinite(uv), uv, np.float32(0.0)).astype(np.float64)
    x = np.mod(uv[:, 0], 1.0) * width - 0.5
    y = np.mod(uv[:, 1], 1.0) * height - 0.5
    left, low = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
    right_part, high_part = (x - left).astype(np.float32)[:, None], (y - low).astype(np.float32)[:, None]
    columns, rows = (left % width, (left + 1) % width), (low % height, (low + 1) % height)
    lower = texture[rows[0], columns[0]] * (1 - right_part) + texture[rows[0], columns[1]] * right_part
    upper = texture[rows[1], columns[0]] * (1 - right_part) + texture[rows[1], columns[1]] * right_part
    return np.asarray(lower * (1 - high_part) + upper * high_part)
