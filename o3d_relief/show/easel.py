"""What the pictures of the stages are drawn from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

import numpy as np
from numpy.typing import NDArray

from o3d_relief.errors import ParameterError
from o3d_relief.records import PerspectiveStage, SceneStage, StageRecord
from o3d_relief.show.camera import view_direction

if TYPE_CHECKING:
    import open3d as o3d

__all__ = ["OBLIQUE", "SIDE", "STILL", "Easel", "Pictures"]

OBLIQUE = view_direction(38.0, 12.0)
"""From where most right panels are seen."""

SIDE = view_direction(65.0, 8.0)
"""From where depth is seen best."""

STILL = 1e-9
"""Relief units up to which nothing has moved and nothing stands out: there is no scale for that."""

Pictures = list[NDArray[np.uint8]]
_Record = TypeVar("_Record", bound=StageRecord)


@dataclass(frozen=True, kw_only=True, eq=False)
class Easel:
    """The records of a run, and how large to draw.

    Attributes
    ----------
    stages : mapping of str to StageRecord
    size : (width, height)
        Of one panel, in pixels.
    relief : open3d.geometry.TriangleMesh or None
        The finished relief.
    """

    stages: Mapping[str, StageRecord]
    size: tuple[int, int]
    relief: o3d.geometry.TriangleMesh | None = None

    def record(self, kind: type[_Record]) -> _Record:
        """Return the record of a stage.

        Raises
        ------
        ParameterError
            There is none.
        """
        record = self.stages.get(kind.name)
        if not isinstance(record, kind):
            raise ParameterError(f"The stage {kind.name!r} has no record.")
        return record

    @property
    def vertices(self) -> NDArray[np.float64]:
        """The vertices (n, 3) after the forced perspective."""
        return self.record(PerspectiveStage).vertices

    def raised(self, z: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the vertices with other heights (n,)."""
        return np.column_stack([self.vertices[:, :2], z])

    def mesh(self, vertices: NDArray[np.float64]) -> o3d.geometry.TriangleMesh:
        """Return the scene's faces over these vertices (n, 3)."""
        import open3d as o3d

        return o3d.geometry.TriangleMesh(
            o3d.utility.Vector3dVector(vertices.copy()),  # records are read-only
            o3d.utility.Vector3iVector(self.record(SceneStage).faces.astype(np.int32)),
        )
