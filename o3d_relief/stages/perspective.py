"""Forced perspective towards a vanishing point (section 3.1, Appendix II)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from o3d_relief.errors import ParameterError

__all__ = ["forced_perspective"]

_NEAREST = 0.01
"""Nearer than this to the vanishing point, in relief units, whole parts would shrink to a point."""


def forced_perspective(
    vertices: NDArray[np.float64],
    vanishing_point: tuple[float, float, float],
    *,
    view_plane: float | None = None,
) -> NDArray[np.float64]:
    """Draw a scene together towards a vanishing point g.

    v_p^x = v^x - (v^x - g^x) (v^z - u^z) / (g^z - u^z), the same in y; z stays (Appendix II). What lies
    in the view plane z = u^z keeps its size, what lies at g^z would shrink to g. g^z = -inf is the
    identity.

    Parameters
    ----------
    vertices : (n, 3) float64
        In the relief frame.
    vanishing_point : three floats
        g, behind the relief plane; its z may be -inf.
    view_plane : float, optional
        u^z, not behind the frontmost vertex; the frontmost vertex itself where omitted.

    Returns
    -------
    (n, 3) float64

    Raises
    ------
    ParameterError
        g does not lie behind S and the scene, or u^z lies behind the frontmost vertex.

    Examples
    --------
    >>> forced_perspective(np.array([[4.0, 2, 0], [4, 2, 10]]), (0.0, 0.0, -10.0)).tolist()
    [[2.0, 1.0, 0.0], [4.0, 2.0, 10.0]]
    """
    front = float(vertices[:, 2].max())
    u_z = front if view_plane is None else float(view_plane)
    g = np.asarray(vanishing_point, dtype=np.float64)
    if g[2] > min(0.0, float(vertices[:, 2].min())) - _NEAREST:
        raise ParameterError(
            f"vanishing_point must lie behind the relief plane and the scene, by {_NEAREST:g} relief units "
            f"at least. Got z = {g[2]:g} instead."
        )
    if u_z < front:
        raise ParameterError(
            f"viewpoint must lie in front of the scene (z of at least {front:g}). Got z = {u_z:g} instead."
        )
    moved = vertices.copy()
    share = (vertices[:, 2] - u_z) / (g[2] - u_z)
    moved[:, :2] -= (vertices[:, :2] - g[:2]) * share[:, None]
    return np.asarray(moved)
