"""A relief, what it was made of, and what it keeps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from o3d_relief.bounds.certificate import Certificate, certify
from o3d_relief.params import ReliefParams, View
from o3d_relief.records import StageRecord, final_heights
from o3d_relief.scan_params import ScanParams
from o3d_relief.scene.packed import MeshRecord
from o3d_relief.scene.weld import weld
from o3d_relief.stages.trim import Trimmed

__all__ = ["Relief"]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Relief(MeshRecord):
    """A high relief and how it came about.

    It can be pickled, for the same version of this package, and copied, which Open3D's meshes cannot.

    Attributes
    ----------
    mesh : open3d.geometry.TriangleMesh
        In the relief frame (x right, y up, z towards the viewer, S at z = 0), in the input's unit.
    to_scene : (4, 4) float64
        Takes the relief frame to the input's frame.
    source_index : (n_out,) int64
        Input vertex of each output vertex, -1 for a vertex made by the cut. The input of a point cloud
        is its mesh, of the stage "parts".
    stages : mapping of str to StageRecord
        One record for each stage, in order; for a point cloud, those of its meshing come first.
    params : ReliefParams
    view : View
    certificate : Certificate
        What was tested and what failed; computed when it is first asked for.
    trimmed : Trimmed
        How the cut was made: between which input vertices each output vertex lies, the input face of each
        output face.
    scan : ScanParams or None
        How the point cloud was meshed, if it was one.
    """

    to_scene: NDArray[np.float64]
    source_index: NDArray[np.int64]
    stages: Mapping[str, StageRecord]
    params: ReliefParams
    view: View
    trimmed: Trimmed
    scan: ScanParams | None = None

    def __repr__(self) -> str:
        depth = float(np.asarray(self.mesh.vertices)[:, 2].max())
        return (
            f"<Relief: {len(self.mesh.vertices)} vertices, {len(self.mesh.triangles)} triangles, "
            f"{depth:.4g} deep, stages {', '.join(self.stages)}>"
        )

    def _repr_png_(self) -> bytes:
        """Show the relief in a notebook: a sheet of views."""
        from o3d_relief.show.notebook import relief_png  # drawing is not needed to make a relief

        return relief_png(self)

    @cached_property
    def certificate(self) -> Certificate:
        """Test what the relief keeps of its scene, on its mesh; done when it is first asked for."""
        scene: Any = self.stages["scene"]
        in_z = np.append(scene.vertices[:, 2], 0.0)[scene.welded_index]  # -1, unused, takes the last one
        before = self.trimmed.to_vertices(in_z[:, None])[:, 0]
        welded = weld(self.trimmed.vertices / scene.unit, self.trimmed.faces)
        _, first = np.unique(np.append(-1, welded.index), return_index=True)
        stages: dict[str, Any] = dict(self.stages)
        return certify(
            relief=welded.vertices,
            relief_faces=welded.faces,
            relief_before=before[first[1:] - 1],
            relief_parents=scene.welded_index[self.trimmed.parents[welded.face_from]],
            scene=stages["perspective"].vertices,
            scene_faces=scene.faces,
            heights=final_heights(stages),
            visible=stages["visibility"].visible,
            points=stages["bounded"].attached if self.params.bounded else stages["attenuation"].kept_index,
            min_gap=self.params.min_gap / scene.unit,
        )

    def report(self) -> dict[str, Any]:
        """Sum the relief up in plain values, for JSON.

        Returns
        -------
        dict
            The summary, and the certificate with a sentence for each thing that does not hold.
        """
        certificate = asdict(self.certificate) | {"failures": self.certificate.failures}
        return self.summary() | {"certificate": certificate}

    def summary(self) -> dict[str, Any]:
        """Sum up what is known without further measurement.

        Returns
        -------
        dict
            Parameters and view, the depth of the scene and of the relief (everything and visible vertices
            alone, in the input's unit), the share of the visible vertices that lay behind S before the
            trim, in bounded mode the `energy_gap` of its stage, and the time and counts of each stage.
        """
        stages: dict[str, Any] = dict(self.stages)
        scene, z, visible = stages["scene"], final_heights(stages), stages["visibility"].visible
        before = scene.vertices[:, 2]
        return {
            "params": {name: value for name, value in asdict(self.params).items() if name != "weights"},
            "mode": "bounded" if self.params.bounded else "attenuation",
            "view": asdict(self.view),
            "scan": None if self.scan is None else asdict(self.scan),
            "unit": scene.unit,
            "scene_depth": float(np.ptp(before)) * scene.unit,
            "scene_visible_depth": float(np.ptp(before[visible])) * scene.unit,
            "relief_depth": float(np.asarray(self.mesh.vertices)[:, 2].max()),
            "relief_visible_depth": float(np.ptp(z[visible])) * scene.unit,
            "visible_behind_share": float((z[visible] < 0.0).mean()),
            "energy_gap": getattr(stages.get("bounded"), "energy_gap", None),
            "vertices": len(self.mesh.vertices),
            "triangles": len(self.mesh.triangles),
            "stages": {
                name: {"seconds": record.seconds, "counts": dict(record.counts)}
                for name, record in self.stages.items()
            },
        }
