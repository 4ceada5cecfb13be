"""The surface that each stage of a run leaves, gathered while the records come in."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from o3d_relief.records import (
    BoundedStage,
    CompressionStage,
    ConstructionStage,
    OrderStage,
    PerspectiveStage,
    RestorationStage,
    SceneStage,
    StageRecord,
    TrimStage,
)

if TYPE_CHECKING:
    from o3d_relief.relief import Relief

__all__ = ["CutRelief", "StageSurfaces"]

_HEIGHTS = (ConstructionStage, RestorationStage, OrderStage, CompressionStage, BoundedStage)


@dataclass(frozen=True, kw_only=True, eq=False)
class CutRelief:
    """The finished relief, as plain arrays.

    Attributes
    ----------
    vertices : (c, 3) float64
        In the relief frame, in relief units.
    faces : (b, 3) int64
    normals : (c, 3) float64
    welded : (c,) int64
        The welded vertex that each vertex is, or lies nearest to on the edge that was cut.
    made : (c,) bool
        Whether the cut has made it.
    colors : (c, 3) float64 or None
        sRGB in [0, 1].
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    normals: NDArray[np.float64]
    welded: NDArray[np.int64]
    made: NDArray[np.bool_]
    colors: NDArray[np.float64] | None

    @classmethod
    def of(cls, relief: Relief) -> CutRelief:
        """Take what is to be shown out of a relief."""
        from o3d_relief.show.mesh_colors import vertex_colors

        scene: Any = relief.stages[SceneStage.name]
        trimmed = relief.trimmed
        nearest = np.where(trimmed.vertex_share < 0.5, *trimmed.vertex_from.T)
        return cls(
            vertices=np.array(relief.mesh.vertices) / scene.unit,
            faces=np.array(relief.mesh.triangles, dtype=np.int64),
            normals=np.array(relief.mesh.vertex_normals),
            welded=scene.welded_index[nearest],
            made=relief.source_index < 0,
            colors=vertex_colors(relief.mesh),
        )


class StageSurfaces:
    """The surfaces of the stages so far, all on the welded vertices.

    Attributes
    ----------
    records : dict of str to StageRecord
        In the order of the stages.
    cut : CutRelief or None
        The finished relief.
    """

    def __init__(self) -> None:
        self.records: dict[str, StageRecord] = {}
        self.cut: CutRelief | None = None
        self._surfaces: list[NDArray[np.float64]] = []

    def add(self, record: StageRecord) -> bool:
        """Take up a record.

        Parameters
        ----------
        record : StageRecord

        Returns
        -------
        bool
            False for one that has no surface in the relief frame: of the meshing of a point cloud.
        """
        surface = self._surface_after(record)
        if surface is None:
            return False
        self.records[record.name] = record
        self._surfaces.append(surface)
        return True

    def _surface_after(self, record: StageRecord) -> NDArray[np.float64] | None:
        if isinstance(record, SceneStage | PerspectiveStage):
            return record.vertices
        if not self._surfaces:
            return None
        last = self._surfaces[-1]
        if isinstance(record, _HEIGHTS):
            return np.column_stack([last[:, :2], record.z])
        if isinstance(record, TrimStage):
            return np.column_stack([last[:, :2], np.maximum(last[:, 2], 0.0)])
        return last

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the stages."""
        return tuple(self.records)

    @property
    def faces(self) -> NDArray[np.int64]:
        """The welded faces (m, 3)."""
        scene: Any = self.records[SceneStage.name]
        return np.asarray(scene.faces)

    def surface(self, stage: int) -> NDArray[np.float64]:
        """Return the vertices (n, 3) after a stage, in relief units.

        After the cut these are still all of them, those behind S moved onto it; `cut` has the mesh itself.
        """
        return self._surfaces[stage]

    def before(self, stage: int) -> int | None:
        """Return the last stage before this one whose surface differs, None where nothing has moved."""
        for earlier in range(stage - 1, -1, -1):
            if not np.array_equal(self._surfaces[earlier], self._surfaces[stage]):
                return earlier
        return None

    def is_cut(self, stage: int) -> bool:
        """Tell whether a stage shows the finished relief."""
        return self.cut is not None and self.names[stage] == TrimStage.name
