"""Where the stage viewer's camera stands."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from o3d_relief.params import Triple

__all__ = ["look_from"]

_FAR_DEGREES = 5.0
"""The narrowest field of view of Open3D's visualizer, at which it draws without perspective."""


def look_from(window: Any, viewpoint: Triple | None, bounds: NDArray[np.float64]) -> None:
    """Put the camera of a visualizer at the viewpoint u, or far in front of the scene.

    Parameters
    ----------
    window : open3d.visualization.Visualizer
    viewpoint : three floats or None
        In relief units; None: infinitely far.
    bounds : (2, 3) float64
        Of the scene.
    """
    control = window.get_view_control()
    middle = bounds.mean(axis=0)
    if viewpoint is None:
        control.change_field_of_view(_FAR_DEGREES - control.get_field_of_view())
        control.set_front([0.0, 0.0, 1.0])
        control.set_up([0.0, 1.0, 0.0])
        control.set_lookat(middle)
        control.set_zoom(0.6)
        return
    camera = control.convert_to_pinhole_camera_parameters()
    eye = np.asarray(viewpoint, dtype=np.float64)
    back = (eye - middle) / np.linalg.norm(eye - middle)
    right = np.cross((0.0, 1.0, 0.0), back)
    right = right / np.linalg.norm(right)
    turn = np.array([right, -np.cross(back, right), -back])  # x right, y down, z ahead
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn, -turn @ eye
    camera.extrinsic = matrix
    control.convert_from_pinhole_camera_parameters(camera, True)
