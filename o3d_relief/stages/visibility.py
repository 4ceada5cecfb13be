"""Which vertices the viewpoint u sees (section 3.2)."""

from __future__ import annotations

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from o3d_relief.errors import ParameterError
from o3d_relief.rays import UnitBox

__all__ = ["turned_away", "visible_vertices"]

_NEAR = 1e-4
"""A ray leaves its vertex by this share of the scene's size before it can hit anything, because it would
hit the vertex's own triangles."""


def visible_vertices(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    *,
    viewpoint: tuple[float, float, float] | None = None,
    box: UnitBox | None = None,
) -> NDArray[np.bool_]:
    """Find the vertices from which the open segment to the viewpoint u is free.

    Cast with Open3D's RaycastingScene, which computes in float32: the scene is brought into the unit box
    first.

    Parameters
    ----------
    vertices : (n, 3) float64
        In the relief frame.
    faces : (m, 3) int64
    viewpoint : three floats, optional
        u, in front of every vertex; infinitely far along +z where omitted.
    box : UnitBox, optional
        Of the mesh, where it is at hand already.

    Returns
    -------
    (n,) bool

    Raises
    ------
    ParameterError
        u does not lie in front of the scene.
    """
    front = float(vertices[:, 2].max())
    if viewpoint is not None and not viewpoint[2] > front:
        raise ParameterError(
            f"viewpoint must lie in front of the scene (z > {front:g} relief units). "
            f"Got z = {viewpoint[2]:g} instead."
        )
    if box is None:
        return ~_hidden(UnitBox(vertices, faces), vertices, viewpoint)
    if viewpoint is not None:
        return ~_hidden(box, vertices, viewpoint)
    # Who has the mesh in a box casts the same rays, from still closer to the vertices.
    met = box.above["t_hit"].numpy()
    hidden = np.isfinite(met)
    close = np.flatnonzero(met < 2.0 * _NEAR)
    if len(close):  # Open3D dies of a list without rays
        hidden[close] = _hidden(box, vertices[close], None)
    return np.asarray(~hidden)


def _hidden(
    box: UnitBox, vertices: NDArray[np.float64], viewpoint: tuple[float, float, float] | None
) -> NDArray[np.bool_]:
    """Tell between which vertices and the viewpoint something lies."""
    rays = np.zeros((len(vertices), 6), dtype=np.float32)
    rays[:, 5] = 1.0
    if viewpoint is not None:
        towards = (np.asarray(viewpoint, dtype=np.float64) - vertices) / box.size
        # Past the scene's front nothing can be hit: unit directions keep the offset of a far u small. The
        # squares of a very far one must not overflow.
        towards /= np.abs(towards).max(axis=1, keepdims=True)
        towards /= np.linalg.norm(towards, axis=1, keepdims=True)
        rays[:, 3:] = towards
    rays[:, :3] = ((vertices - box.middle) / box.size).astype(np.float32) + np.float32(_NEAR) * rays[:, 3:]
    return np.asarray(box.scene.test_occlusions(o3d.core.Tensor(rays)).numpy().astype(bool))


def turned_away(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    visible: NDArray[np.bool_],
    label: NDArray[np.int32],
) -> NDArray[np.bool_]:
    """Find the components that show the viewer their inside.

    A relief is open at the back: where the faces of a scan turn the wrong way, viewers and slicers would take
    its front for its inside.

    Parameters
    ----------
    vertices : (n, 3) float64
        In the relief frame.
    faces : (m, 3) int64
    visible : (n,) bool
    label : (n,) int
        Connected component of each vertex.

    Returns
    -------
    (components,) bool
        True where the visible faces, by their area as seen from the front, turn away from the viewer.
    """
    a, b, c = np.ascontiguousarray(faces.T)
    x, y = np.ascontiguousarray(vertices[:, :2].T)
    seen_area = (x[b] - x[a]) * (y[c] - y[a]) - (y[b] - y[a]) * (x[c] - x[a])
    seen_area[~(visible[a] & visible[b] & visible[c])] = 0.0
    total = np.bincount(label[a], weights=seen_area, minlength=int(label.max()) + 1)
    return np.asarray(total < 0.0)
