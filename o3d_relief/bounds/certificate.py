"""What a finished relief keeps of its scene, measured on its mesh, not on the solver's variables."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import open3d as o3d
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from o3d_relief.bounds.pairs import Pairs, grid_pairs, vertex_pairs
from o3d_relief.rays import unit_box

__all__ = ["Certificate", "certify", "crossings", "inversions", "normal_changes"]

_SAME = 1e-3
"""Relief units below which float32 rays do not tell two surfaces apart."""

_NEAR = 1.0
"""A face is near an attenuation point within this distance, in relief units."""

_INSIDE = 1e-3
"""Share at both ends of an edge that does not count as crossing: there it meets its neighbours."""


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
    worst_inversion : float
        How far the worst of them stood the other way round in the scene, in relief units.
    gaps_tested, gaps_missed : int
        Pairs that were at least the asked gap apart in the scene, and those that are not in the relief.
    edges_tested, new_crossings, old_crossings : int
        Edges of the relief, pairs of an edge and a triangle that cross in the relief but not in the scene,
        and pairs that cross in both: an input that intersects itself keeps these.
    faces_near_points, faces_elsewhere : int
        Visible faces within one relief unit of a kept attenuation point, and the others.
    bend_near_points, bend_elsewhere : float
        99th percentile of the angle between their normals in the scene and in the relief, in degrees.
    places : tuple of (x, y)
        Where the first few inversions are, in relief units.
    """

    visible_tested: int
    visible_behind: int
    vertex_pairs_tested: int
    vertex_inversions: int
    grid_pairs_tested: int
    grid_inversions: int
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
    places: tuple[tuple[float, float], ...]

    @property
    def failures(self) -> list[str]:
        """One sentence for each thing that does not hold; empty where everything holds."""
        where = ", ".join(f"({x:.1f}, {y:.1f})" for x, y in self.places)
        found = []
        if self.visible_behind:
            share = f"{self.visible_behind} of {self.visible_tested}"
            found.append(f"{share} visible vertices lie behind the plane.")
        inverted = self.vertex_inversions + self.grid_inversions
        if inverted:
            tested = self.vertex_pairs_tested + self.grid_pairs_tested
            found.append(
                f"{inverted} of {tested} pairs of surfaces changed places, by up to "
                f"{self.worst_inversion:.3f} relief units, for instance at {where}."
            )
        if self.gaps_missed:
            found.append(f"{self.gaps_missed} of {self.gaps_tested} gaps are smaller than asked for.")
        if self.new_crossings:
            found.append(
                f"Edges and triangles cross at {self.new_crossings} places where they did not in the scene."
            )
        if self.bend_near_points > self.bend_elsewhere:
            found.append(
                f"Faces near attenuation points are bent by {self.bend_near_points:.0f} degrees (99th "
                f"percentile), more than the {self.bend_elsewhere:.0f} elsewhere."
            )
        return found


@dataclass(frozen=True, kw_only=True, eq=False)
class _Inversions:
    tested: int
    inverted: int
    worst: float
    gaps_tested: int
    gaps_missed: int
    places: tuple[tuple[float, float], ...]


def inversions(
    vertices: NDArray[np.float64], pairs: Pairs, before: NDArray[np.float64], *, min_gap: float = 0.0
) -> _Inversions:
    """Count the pairs of a relief that stood the other way round in the scene.

    Parameters
    ----------
    vertices : (n, 3) float64
        Of the relief, in relief units.
    pairs : Pairs
        What is stacked in the relief.
    before : (n,) float64
        The z of each vertex in the scene.
    min_gap : float
        In relief units.

    Returns
    -------
    counts
    """
    upper, lower = pairs.heights(before)
    gap = upper - lower
    inverted = gap < -_SAME
    wide = gap >= max(min_gap, _SAME)
    missed = wide & (pairs.gap < min_gap - _SAME)
    corners = vertices[pairs.upper[inverted][:10]]
    middle = np.einsum("pcx,pc->px", corners, pairs.upper_weights[inverted][:10])
    return _Inversions(
        tested=len(pairs),
        inverted=int(inverted.sum()),
        worst=float(np.abs(gap[inverted]).max(initial=0.0)),
        gaps_tested=int(wide.sum()),
        gaps_missed=int(missed.sum()) if min_gap > 0.0 else 0,
        places=tuple((float(x), float(y)) for x, y, _ in middle),
    )


def crossings(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> tuple[set[tuple[int, int]], int]:
    """Find the edges that cross triangles of a welded mesh.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int64

    Returns
    -------
    crossing : set of (edge, face)
        Edges numbered by their sorted vertices; an edge and a triangle that share a vertex do not count.
    edges : int
        Number of edges tested.
    """
    edges = np.unique(np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    scene, middle, size = unit_box(vertices, faces)
    start, end = vertices[edges[:, 0]], vertices[edges[:, 1]]
    rays = np.concatenate([(start - middle) / size, (end - start) / size], axis=1).astype(np.float32)
    hits = scene.list_intersections(o3d.core.Tensor(rays))
    t = hits["t_hit"].numpy()
    ray = hits["ray_ids"].numpy().astype(np.int64)
    face = hits["primitive_ids"].numpy().astype(np.int64)
    inside = (t > _INSIDE) & (t < 1.0 - _INSIDE)
    ray, face = ray[inside], face[inside]
    apart = (edges[ray][:, :, None] != faces[face][:, None, :]).all(axis=(1, 2))
    return set(zip(ray[apart].tolist(), face[apart].tolist(), strict=True)), len(edges)


def normal_changes(
    before: NDArray[np.float64],
    after: NDArray[np.float64],
    faces: NDArray[np.int64],
    visible: NDArray[np.bool_],
    points: NDArray[np.int64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Measure how far the normals of visible faces have turned.

    Parameters
    ----------
    before, after : (n, 3) float64
    faces : (m, 3) int64
    visible : (n,) bool
    points : (q,) int64
        The kept attenuation points.

    Returns
    -------
    near, elsewhere : (a,), (b,) float64
        Angles in degrees, near the points and elsewhere; faces without an area are left out.
    """
    seen = faces[visible[faces].all(axis=1)]
    one, other = _normals(before[seen]), _normals(after[seen])
    sizes = np.linalg.norm(one, axis=1) * np.linalg.norm(other, axis=1)
    cosine = (one * other).sum(axis=1)[sizes > 0.0] / sizes[sizes > 0.0]
    angle = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
    distance, _ = cKDTree(before[points]).query(before[seen[sizes > 0.0]].mean(axis=1))
    return angle[distance <= _NEAR], angle[distance > _NEAR]


def _normals(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def certify(
    *,
    relief: NDArray[np.float64],
    relief_faces: NDArray[np.int64],
    relief_before: NDArray[np.float64],
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
    stacked = {
        "vertex": inversions(relief, vertex_pairs(relief, relief_faces), relief_before, min_gap=min_gap),
        "grid": inversions(relief, grid_pairs(relief, relief_faces), relief_before, min_gap=min_gap),
    }
    now, edges = crossings(relief, relief_faces)
    then, _ = crossings(np.column_stack([relief[:, :2], relief_before]), relief_faces)
    near, elsewhere = normal_changes(
        scene, np.column_stack([scene[:, :2], heights]), scene_faces, visible, points
    )
    both = stacked["vertex"], stacked["grid"]
    return Certificate(
        visible_tested=int(visible.sum()),
        visible_behind=int((heights[visible] < 0.0).sum()),
        vertex_pairs_tested=both[0].tested,
        vertex_inversions=both[0].inverted,
        grid_pairs_tested=both[1].tested,
        grid_inversions=both[1].inverted,
        worst_inversion=max(found.worst for found in both),
        gaps_tested=sum(found.gaps_tested for found in both),
        gaps_missed=sum(found.gaps_missed for found in both),
        edges_tested=edges,
        new_crossings=len(now - then),
        old_crossings=len(now & then),
        faces_near_points=len(near),
        faces_elsewhere=len(elsewhere),
        bend_near_points=float(np.percentile(near, 99)) if len(near) else 0.0,
        bend_elsewhere=float(np.percentile(elsewhere, 99)) if len(elsewhere) else 0.0,
        places=(both[0].places + both[1].places)[:10],
    )
