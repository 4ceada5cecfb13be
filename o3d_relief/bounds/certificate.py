"""What a finished relief keeps of its scene, measured on its mesh, not on the solver's variables."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from o3d_relief.bounds.crossings import crossings, edges_of
from o3d_relief.bounds.grid import grid_pairs
from o3d_relief.bounds.inversions import inversions
from o3d_relief.bounds.lines import Lines, upright
from o3d_relief.bounds.near_points import NearPoints
from o3d_relief.bounds.origin import Origin
from o3d_relief.bounds.pairs import vertex_pairs
from o3d_relief.bounds.places import Place, behind_places, crossing_places, told

__all__ = ["Certificate", "certify"]


@dataclass(frozen=True, kw_only=True)
class Certificate:
    """Counts of what was tested and of what failed.

    Attributes
    ----------
    visible_tested, visible_behind : int
        Visible vertices, and those that end behind S before the trim.
    vertex_pairs_tested, vertex_inversions : int
        Pairs of a vertex and the next surface above or below it in the relief, and those that stood the
        other way round in the scene.
    grid_pairs_tested, grid_inversions : int
        The same for surfaces that follow each other on a grid of 1024 x 1024 lines.
    old_inversions : int
        Pairs of both kinds that stand the other way round where their two triangles crossed in the scene
        already: these do not count as inversions.
    worst_inversion : float
        How far the worst of them stood the other way round in the scene, in relief units.
    gaps_tested, gaps_missed : int
        Pairs that were at least the asked gap apart in the scene, and those that are not in the relief.
    edges_tested, new_crossings, old_crossings : int
        Edges of the relief, pairs of an edge and a triangle that cross in the relief but not in the scene,
        by more than 1e-3 relief units to both sides, and pairs that cross in both: an input that
        intersects itself keeps these.
    faces_near_points, faces_elsewhere : int
        Visible faces within one relief unit of a kept attenuation point, and the others.
    bend_near_points, bend_elsewhere : float
        99th percentile of the angle between their normals in the scene and in the relief, in degrees.
    places : tuple of Place
        At most ten of each kind of what is counted above on each kind of line, spread over all of them: the
        surfaces in question, in relief units, and why they are not as they should be, where the relief and
        its scene tell. Those of kind "old inversion" and "old crossing" are no failures.
    """

    visible_tested: int
    visible_behind: int
    vertex_pairs_tested: int
    vertex_inversions: int
    grid_pairs_tested: int
    grid_inversions: int
    old_inversions: int
    worst_inversion: float
    gaps_tested: int
    gaps_missed: int
    edges_tested: int
    new_crossings: int
    old_crossings: int
    faces_near_points: int
    faces_elsewhere: int
    bend_near_points: float
    bend_elsewhere: float
    places: tuple[Place, ...] = field(repr=False)

    @property
    def failures(self) -> list[str]:
        """One sentence for each thing that does not hold; empty where everything holds."""
        found = []
        if self.visible_behind:
            share = f"{self.visible_behind} of {self.visible_tested}"
            found.append(
                f"{share} visible vertices lie behind the plane, {told(self.places, 'visible behind')}."
            )
        inverted = self.vertex_inversions + self.grid_inversions
        if inverted:
            tested = self.vertex_pairs_tested + self.grid_pairs_tested
            found.append(
                f"{inverted} of {tested} pairs of surfaces changed places, by up to "
                f"{self.worst_inversion:.3f} relief units, {told(self.places, 'inversion')}."
            )
        if self.gaps_missed:
            found.append(
                f"{self.gaps_missed} of {self.gaps_tested} gaps are smaller than asked for, "
                f"{told(self.places, 'missed gap')}."
            )
        if self.new_crossings:
            found.append(
                f"Edges and triangles cross at {self.new_crossings} places where they did not in the scene, "
                f"{told(self.places, 'new crossing')}."
            )
        if self.bend_near_points > self.bend_elsewhere:
            found.append(
                f"Faces near points that are held are bent by {self.bend_near_points:.0f} degrees (99th "
                f"percentile), more than the {self.bend_elsewhere:.0f} elsewhere."
            )
        return found


def certify(
    *,
    relief: NDArray[np.float64],
    relief_faces: NDArray[np.int64],
    relief_before: NDArray[np.float64],
    relief_parents: NDArray[np.int64],
    scene: NDArray[np.float64],
    scene_faces: NDArray[np.int64],
    heights: NDArray[np.float64],
    visible: NDArray[np.bool_],
    points: NDArray[np.int64],
    min_gap: float,
) -> Certificate:
    """Test a relief against its scene; everything in relief units.

    Parameters
    ----------
    relief : (n_out, 3) float64
        Vertices of the trimmed relief, welded.
    relief_faces : (m_out, 3) int64
    relief_before : (n_out,) float64
        The z of each of them in the scene.
    relief_parents : (m_out, 3) int64
        Vertices of the scene's face that each of the relief's faces is a part of.
    scene : (n, 3) float64
        Welded vertices of the scene, after the forced perspective.
    scene_faces : (m, 3) int64
    heights : (n,) float64
        The z of the welded vertices before the trim.
    visible : (n,) bool
    points : (q,) int64
        The kept attenuation points.
    min_gap : float

    Returns
    -------
    Certificate
    """
    before = np.column_stack([relief[:, :2], relief_before])
    origin = Origin(relief_faces, relief_parents, scene)
    # Pairs leave out what stands upright in the relief, and here also what did so in the scene.
    lying = relief_faces[~upright(before, relief_faces)]
    low, high, lines = scene.min(axis=0), scene.max(axis=0), Lines(relief, lying)
    stacked = (
        vertex_pairs(lines),
        grid_pairs(lines, low=low, high=high),
    )
    both = [inversions(relief, pairs, relief_before, origin, min_gap=min_gap) for pairs in stacked]
    edges = edges_of(relief_faces)
    met = crossings(relief, relief_faces, edges)
    met = met.select(met.pierced(relief[:, 2]))
    old = met.pierced(relief_before) | origin.crossed(met.edge[:, [0, 1, 1]], met.face)
    near, elsewhere = NearPoints(scene, scene_faces, visible, points).bends.angles(heights)
    return Certificate(
        visible_tested=int(visible.sum()),
        visible_behind=int((heights[visible] < 0.0).sum()),
        vertex_pairs_tested=both[0].tested,
        vertex_inversions=both[0].inverted,
        grid_pairs_tested=both[1].tested,
        grid_inversions=both[1].inverted,
        old_inversions=sum(found.crossed for found in both),
        worst_inversion=max(found.worst for found in both),
        gaps_tested=sum(found.gaps_tested for found in both),
        gaps_missed=sum(found.gaps_missed for found in both),
        edges_tested=len(edges),
        new_crossings=int((~old).sum()),
        old_crossings=int(old.sum()),
        faces_near_points=len(near),
        faces_elsewhere=len(elsewhere),
        bend_near_points=float(np.percentile(near, 99)) if len(near) else 0.0,
        bend_elsewhere=float(np.percentile(elsewhere, 99)) if len(elsewhere) else 0.0,
        # Lines of the grid come first: they know all that is stacked on them.
        places=behind_places(scene, heights, visible)
        + both[1].places
        + both[0].places
        + crossing_places(relief, relief_before, met, old, origin),
    )
