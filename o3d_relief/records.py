"""The record that each stage of the pipeline leaves behind.

Arrays are in the relief frame and in relief units (the larger of the scene's x and y extents is 100),
on the welded vertices, and read-only. n is the number of welded vertices, m of welded faces, k of
clusters, p <= k of attenuation points, n_in of input vertices.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from o3d_relief.frozen import Frozen

__all__ = [
    "AttenuationStage",
    "BoundedStage",
    "ClustersStage",
    "CompressionStage",
    "ConstructionStage",
    "OrderStage",
    "PerspectiveStage",
    "RestorationStage",
    "SceneStage",
    "StageRecord",
    "TrimStage",
    "VisibilityStage",
    "final_heights",
]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class StageRecord(Frozen):
    """What every stage tells: its wall time and the counts of what it had to settle.

    Attributes
    ----------
    name : str
        The stage's name, its key in ``Relief.stages``.
    seconds : float
        Wall time.
    counts : mapping of str to int
        What was settled on the way (slivers mended, clusters without a visible vertex, ...).
    """

    name: ClassVar[str] = ""
    seconds: float = 0.0
    counts: Mapping[str, int] = field(default_factory=dict)

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self.seconds:.3f} s, {dict(self.counts)}>"


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class SceneStage(StageRecord):
    """The scene, welded, in the relief frame.

    Attributes
    ----------
    vertices : (n, 3) float64
        Welded vertices in relief units; the rearmost lies at z = 0.
    faces : (m, 3) int64
        Welded faces without degenerate and duplicate ones.
    welded_index : (n_in,) int64
        Welded vertex of each input vertex, -1 for one that no kept face uses.
    welded_face : (m_in,) int64
        Welded face of each input face, -1 for a degenerate one.
    unit : float
        Length of one relief unit in the input's unit.
    """

    name: ClassVar[str] = "scene"
    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    welded_index: NDArray[np.int64]
    welded_face: NDArray[np.int64]
    unit: float


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class PerspectiveStage(StageRecord):
    """The scene after the forced perspective (Appendix II).

    Attributes
    ----------
    vertices : (n, 3) float64
        Deformed vertices; equal to the scene's where no vanishing point is given.
    """

    name: ClassVar[str] = "perspective"
    vertices: NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class VisibilityStage(StageRecord):
    """What is seen from the viewpoint u.

    Attributes
    ----------
    visible : (n,) bool
    """

    name: ClassVar[str] = "visibility"
    visible: NDArray[np.bool_]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class ClustersStage(StageRecord):
    """The k-means partition of the vertices on x and y.

    Attributes
    ----------
    labels : (n,) int64
        Cluster of each vertex, 0 ... k - 1.
    centers : (k, 2) float64
    """

    name: ClassVar[str] = "clusters"
    labels: NDArray[np.int64]
    centers: NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class AttenuationStage(StageRecord):
    """The attenuation points and what becomes of them (Eqs. 1-5).

    Attributes
    ----------
    index : (p,) int64
        Vertex of each attenuation point.
    cluster : (p,) int64
        Its cluster.
    height : (p,) float64
        Relief distance before.
    differential : (p,) float64
        Differential relief distance (Eq. 1) among all p points.
    rho : (p,) float64
        Relative differential in [0, 1] (Eq. 2).
    beta : (p,) float64
        Attenuation factor (Eq. 3).
    action : (p,) str
        "attach", "scale" or "discard".
    new_height : (p,) float64
        Relief distance after (Eq. 5), NaN where discarded.
    """

    name: ClassVar[str] = "attenuation"
    index: NDArray[np.int64]
    cluster: NDArray[np.int64]
    height: NDArray[np.float64]
    differential: NDArray[np.float64]
    rho: NDArray[np.float64]
    beta: NDArray[np.float64]
    action: NDArray[np.str_]
    new_height: NDArray[np.float64]

    @property
    def kept_index(self) -> NDArray[np.int64]:
        """(q,) vertices of the points that were not discarded."""
        return np.asarray(self.index[self.action != "discard"])

    @property
    def kept_height(self) -> NDArray[np.float64]:
        """(q,) new heights of the points that were not discarded."""
        return np.asarray(self.new_height[self.action != "discard"])


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class ConstructionStage(StageRecord):
    """The surface rebuilt from its differential coordinates (Eqs. 6-7).

    Attributes
    ----------
    z : (n,) float64
    """

    name: ClassVar[str] = "construction"
    z: NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class RestorationStage(StageRecord):
    """Local depth order errors and their repair (Eq. 8, Appendix VI).

    Attributes
    ----------
    order_error : (n,) float64
        Depth order error in [0, 1], 0 outside every neighbourhood.
    solved : (n,) bool
        The vertices that were solved again.
    stiffness : float
        By how much stiffer than elsewhere the surface was taken to be at the attenuation points.
    z : (n,) float64
    """

    name: ClassVar[str] = "restoration"
    order_error: NDArray[np.float64]
    solved: NDArray[np.bool_]
    stiffness: float = 0.0
    z: NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class OrderStage(StageRecord):
    """Everything in order along the viewing direction, beyond the paper.

    Attributes
    ----------
    z : (n,) float64
        Equal to that of the restoration where the order is not kept (``in_order=False``); then there are
        no counts.
    """

    name: ClassVar[str] = "order"
    z: NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class CompressionStage(StageRecord):
    """The range compression (section 3.3).

    Attributes
    ----------
    alpha : (n,) float64
        Compression ratio of each vertex; 1 where no compression was asked for.
    z : (n,) float64
    """

    name: ClassVar[str] = "compression"
    alpha: NDArray[np.float64]
    z: NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class BoundedStage(StageRecord):
    """The closest relief of the wanted depth, in bounded mode.

    Attributes
    ----------
    face_weight : (m,) float64
        How much a change of each face counts.
    attached : (a,) int64
        Vertices that were to lie on S.
    energy_gap : float
        Bound on how far the energy is above its minimum, as a share of it.
    z : (n,) float64
    """

    name: ClassVar[str] = "bounded"
    face_weight: NDArray[np.float64]
    attached: NDArray[np.int64]
    energy_gap: float = 0.0
    z: NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class TrimStage(StageRecord):
    """The cut at the relief plane; its counts say what was kept."""

    name: ClassVar[str] = "trim"


def final_heights(stages: Mapping[str, StageRecord]) -> NDArray[np.float64]:
    """Return the heights (n,) that the cut was made at, in relief units, of a run in either mode."""
    last: Any = stages[BoundedStage.name if BoundedStage.name in stages else CompressionStage.name]
    return np.asarray(last.z)
