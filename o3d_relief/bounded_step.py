"""The step of the pipeline that stands in for all others in bounded mode."""

from __future__ import annotations

from typing import cast

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from o3d_relief.bounds.bounded import closest_relief, lowest_seen
from o3d_relief.bounds.extremes import extreme_pairs
from o3d_relief.bounds.grid import grid_pairs
from o3d_relief.bounds.lines import Lines
from o3d_relief.bounds.pairs import Pairs, vertex_pairs
from o3d_relief.bounds.parts import tie_parts
from o3d_relief.bounds.rows import point_rows
from o3d_relief.bounds.seen import face_weights, seen_faces, seen_points
from o3d_relief.bounds.sides import side_pull
from o3d_relief.bounds.silhouettes import silhouette_pairs
from o3d_relief.errors import ParameterError
from o3d_relief.linalg.laplacian import cotangent_laplacian
from o3d_relief.params import ReliefParams
from o3d_relief.progress import Tick, silent
from o3d_relief.records import BoundedStage, SceneStage
from o3d_relief.steps import on_plane

__all__ = ["bounded_step", "check_bounded"]

_SHALLOWEST = 1e-3
"""Smallest depth in relief units: what is closer together nothing here tells apart."""

_ROUNDING = 1e-12
"""By so much, as a share, may a depth be missed that is all of the scene's."""

_CONTACT = 1e-3
"""Gap in relief units up to which surfaces touch: they have no order."""

_EMPTY = 1e-3
"""Stiffness of the springs across gaps in bounded mode: empty space gives depth away for nothing, the springs
only settle what nothing else does."""

_PULLED, _PAIRED = 0.1, 0.2
"""Shares of the work after which it is known what the views from the side ask for, and what is stacked."""


def bounded_step(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    visible: NDArray[np.bool_],
    scene: SceneStage,
    params: ReliefParams,
    *,
    tick: Tick = silent,
) -> BoundedStage:
    """Find the closest relief of the wanted depth."""
    z = vertices[:, 2]
    tick(0.0)
    face, share = seen_points(vertices, faces)
    in_front = seen_faces(faces, visible, face)
    kept = _kept_shape(scene, params)[faces].mean(axis=1)
    attached = _attached(scene, params)
    seen = _seen_rows(faces, visible, face, share)
    lowest = lowest_seen(z, seen, visible)
    deep = float(z.max()) - lowest
    depth = cast(float, params.depth) / scene.unit
    shallow_enough = deep <= depth * (1.0 + _ROUNDING)
    ratio = 1.0 if shallow_enough else depth / deep
    weight = kept * face_weights(vertices, faces, in_front, ratio)
    if shallow_enough:
        shallow = {"already_shallower": 1, "attached_missed": int((z[attached] > lowest).sum())}
        return BoundedStage(face_weight=weight, attached=attached, z=on_plane(z - lowest), counts=shallow)

    _check_depth(depth, scene.unit)
    form, slivers = cotangent_laplacian(vertices, faces, weights=weight)
    middle = (float(z.max()) + lowest) / 2.0
    pull = side_pull(vertices, faces, middle + (z - middle) * ratio, in_front, kept, ratio)
    tick(_PULLED)
    form, pull, pairs = _tied(vertices, faces, form, pull, ratio, params)
    tick(_PAIRED)
    found = closest_relief(
        vertices,
        faces,
        form,
        depth,
        pairs,
        seen,
        visible,
        pull=pull,
        min_gap=params.min_gap / scene.unit,
        attach=attached,
        tick=lambda share: tick(None if share is None else _PAIRED + (1.0 - _PAIRED) * share),
    )
    counts = {
        "already_shallower": 0,
        "slivers_mended": slivers,
        "rounds": found.rounds,
        "constraints": found.watched,
        "pairs_corrected": found.corrected_pairs,
        "attached": len(attached),
        "attached_missed": found.attached_missed,
        "left": found.left,
        "visible_behind": int((found.z[visible] < 0.0).sum()),
    }
    return BoundedStage(
        face_weight=weight, attached=attached, energy_gap=found.gap, z=on_plane(found.z), counts=counts
    )


def check_bounded(
    vertices: NDArray[np.float64], visible: NDArray[np.bool_], scene: SceneStage, params: ReliefParams
) -> float:
    """Refuse what `bounded_step` would refuse, without its long work; return the height of what becomes S."""
    z, faces = vertices[:, 2], scene.faces
    _kept_shape(scene, params)
    _attached(scene, params)
    lowest = lowest_seen(z, _seen_rows(faces, visible, *seen_points(vertices, faces)), visible)
    depth = cast(float, params.depth) / scene.unit
    if float(z.max()) - lowest > depth * (1.0 + _ROUNDING):
        _check_depth(depth, scene.unit)
    return lowest


def _seen_rows(
    faces: NDArray[np.int64], visible: NDArray[np.bool_], face: NDArray[np.int64], share: NDArray[np.float64]
) -> sp.csr_array:
    """Return the rows of the seen points whose faces have hidden corners: others are in front with these."""
    partly = ~visible[faces[face]].all(axis=1)
    return point_rows(faces[face[partly]], share[partly], len(visible))


def _tied(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    form: sp.csr_array,
    pull: NDArray[np.float64],
    ratio: float,
    params: ReliefParams,
) -> tuple[sp.csr_array, NDArray[np.float64], Pairs]:
    """Add springs between parts to the energy and its pull; return all that is stacked, too."""
    lines = Lines(vertices, faces)
    stacked = vertex_pairs(lines)
    every = np.arange(len(vertices))
    ties = tie_parts(vertices, faces, form, every, stacked, stacked.gap * ratio, across_gaps=_EMPTY)
    pairs = _stacked(vertices, faces, lines, stacked, params)
    if ties is None:
        return form, pull, pairs
    return form + ties.among_held, pull + ties.among_held_pull, pairs


def _stacked(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    lines: Lines,
    stacked: Pairs,
    params: ReliefParams,
) -> Pairs:
    """Add to the pairs of vertices those where silhouettes cross, and on a grid what these do not imply."""
    grid = grid_pairs(lines)
    grid = grid.select(grid.gap > _CONTACT)
    if params.min_gap == 0.0:  # what is asked of the others is not linear between two triangles
        grid = extreme_pairs(grid, vertices[:, :2])
    return Pairs.join([stacked, silhouette_pairs(vertices, faces), grid])


def _check_depth(depth: float, unit: float) -> None:
    """Check that a depth in relief units can be told from none."""
    if depth < _SHALLOWEST:
        raise ParameterError(
            f"depth must be at least {_SHALLOWEST * unit:.3g} for this scene, 1/100,000 of its width "
            f"or height: less cannot be told from none. Got {depth * unit:.3g} instead."
        )


def _attached(scene: SceneStage, params: ReliefParams) -> NDArray[np.int64]:
    """Return the welded vertices that are to lie on S."""
    count = len(scene.welded_index)
    chosen = np.array(params.attach, dtype=np.int64)
    if len(chosen) and chosen.max() >= count:
        raise ParameterError(
            f"attach must be numbers of the mesh's {count} vertices. Got {chosen.max()} instead."
        )
    welded = np.unique(scene.welded_index[chosen])
    return np.asarray(welded[welded >= 0])


def _kept_shape(scene: SceneStage, params: ReliefParams) -> NDArray[np.float64]:
    """Return the weight of each welded vertex, the largest of its input vertices."""
    if params.weights is None:
        return np.ones(len(scene.vertices))
    given = np.array(params.weights, dtype=np.float64)
    if len(given) != len(scene.welded_index):
        raise ParameterError(
            f"weights must be one number for each of the mesh's {len(scene.welded_index)} vertices. "
            f"Got {len(given)} numbers instead."
        )
    used = scene.welded_index >= 0
    result = np.zeros(len(scene.vertices))
    np.maximum.at(result, scene.welded_index[used], given[used])
    return result
