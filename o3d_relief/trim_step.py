"""The cut at S as a step of the pipeline, and the faces turned to the viewer before it."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from o3d_relief.records import SceneStage
from o3d_relief.scene.frame import Frame, to_relief_units
from o3d_relief.scene.winding import wrongly_wound
from o3d_relief.stages.trim import Trimmed, trim_behind
from o3d_relief.stages.visibility import turned_away

__all__ = ["trim_step", "turned_to_viewer"]


def trim_step(
    in_vertices: NDArray[np.float64],
    in_faces: NDArray[np.int64],
    frame: Frame,
    scene: SceneStage,
    vertices: NDArray[np.float64],
    z: NDArray[np.float64],
) -> Trimmed:
    """Move every input vertex as its welded vertex moved, and cut at S; the result is in the input's unit."""
    usable = scene.welded_index >= 0
    welded = scene.welded_index[usable]
    moved = to_relief_units(in_vertices, frame)
    moved[usable, :2] += (vertices - scene.vertices)[welded, :2]
    moved[usable, 2] = z[welded]
    return trim_behind(moved * frame.unit, in_faces, usable)


def turned_to_viewer(
    in_faces: NDArray[np.int64],
    scene: SceneStage,
    vertices: NDArray[np.float64],
    visible: NDArray[np.bool_],
    laplacian: sp.csr_array,
) -> tuple[NDArray[np.int64], int]:
    """Turn faces that disagree with their surface, and components that show their inside.

    Return the faces and how many were turned. Of duplicate faces all are turned or none: where a surface has
    both its sides, it keeps them.
    """
    _, label = connected_components(laplacian, directed=False)
    wrong = wrongly_wound(vertices, scene.faces)
    wound = _turned(scene.faces, wrong)
    away = turned_away(vertices, wound, visible, label)
    turn = np.append(wrong ^ away[label[scene.faces[:, 0]]], False)[scene.welded_face]  # -1 takes the last
    return _turned(in_faces, turn), int(turn.sum())


def _turned(faces: NDArray[np.int64], chosen: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return faces, some of them turned round."""
    return np.where(chosen[:, None], faces[:, [0, 2, 1]], faces) if chosen.any() else faces
