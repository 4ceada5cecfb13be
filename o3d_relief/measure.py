"""How good is a relief: what its pictures keep of the scene's, from the front and from the side.

Scene and relief are drawn by orthographic cameras of equal direction and scale, so that a pixel of the one
has its partner at the same place of the other. The cameras look at the point in the middle of the scene's x
and y extents and in the middle of the *visible depth* of what they draw: of the scene, or of the relief. From
the front this changes nothing. From the side it is the turn about which a viewer would compare the two:
neither a hidden back, which a relief may cut off, nor the place of the plane shifts one against the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from o3d_relief.array_checks import as_numbers, check_views
from o3d_relief.bounds.grid import grid_pairs
from o3d_relief.bounds.lines import Lines
from o3d_relief.bounds.pairs import Pairs, vertex_pairs
from o3d_relief.errors import MeshError, ParameterError
from o3d_relief.param_checks import check_whole
from o3d_relief.relief import Relief
from o3d_relief.scene.convert import arrays_mesh, mesh_arrays
from o3d_relief.scene.frame import RELIEF_UNITS
from o3d_relief.show.shots import Body, discontinuities, normal_angle, overlap
from o3d_relief.show.similarity import Picture
from o3d_relief.show.similarity import similarity as ssim

Surface: TypeAlias = o3d.geometry.TriangleMesh | tuple[NDArray[np.float64], NDArray[np.int64]]

__all__ = ["SEVEN_VIEWS", "ReliefQuality", "Yardstick", "measure_relief"]

SEVEN_VIEWS = ((0.0, 0.0), (-20.0, 0.0), (20.0, 0.0), (-40.0, 0.0), (40.0, 0.0), (0.0, -20.0), (0.0, 20.0))
"""The views of the yardstick, degrees to the right and above: the front, sideways, up and down."""

_JUMP = 0.02
"""A depth discontinuity is a jump of at least this share of the visible depth."""

_KEPT = 0.5
"""A discontinuity is kept where it takes this much of the share of the depth that it took in the scene."""

_SAME = 1e-3
"""Relief units below which float32 rays do not tell two surfaces apart."""


@dataclass(frozen=True, kw_only=True)
class ReliefQuality:
    """What a relief keeps of its scene.

    Attributes
    ----------
    views : tuple of (yaw, pitch)
        In degrees to the right and above.
    normal_angles : tuple of float
        Mean angle between the normals of scene and relief in each view, in degrees, over the pixels that both
        cover; NaN where they share none. Normals are those of the triangles, turned to the camera.
    silhouette_overlaps : tuple of float
        Pixels that both cover over pixels that either covers, in each view.
    similarities : tuple of float or None
        Structural similarity (SSIM) of pictures in the same light with cast shadows, in each view, over the
        pixels that either covers. None where it was not asked for.
    discontinuities : int
        Pairs of neighbouring pixels of the frontal picture between which the scene's depth jumps.
    discontinuities_kept : float
        Share of them at which the relief's depth jumps the same way, by at least half of the share of the
        visible depth that the jump took in the scene; NaN where there are none.
    pairs_tested, order_inversions : int or None
        Pairs of surfaces of the scene one behind the other, on lines through its vertices and on a grid of
        1024 x 1024 lines, and those that have changed places. None where the new heights are not known.
    visible_tested, visible_behind : int or None
        Visible vertices, and those behind S by more than 1e-3 relief units. None
        where the new heights are not known.
    scene_depth : float
        The scene's visible depth, in its unit.
    depth : float
        Largest distance of the relief to S, in the same unit.
    """

    views: tuple[tuple[float, float], ...]
    normal_angles: tuple[float, ...]
    silhouette_overlaps: tuple[float, ...]
    similarities: tuple[float, ...] | None
    discontinuities: int
    discontinuities_kept: float
    pairs_tested: int | None
    order_inversions: int | None
    visible_tested: int | None
    visible_behind: int | None
    scene_depth: float
    depth: float

    @property
    def mean_angle(self) -> float:
        """Mean of `normal_angles` over the views."""
        return float(np.mean(self.normal_angles))


class Yardstick:
    """A scene, ready to be compared with reliefs of it.

    Parameters
    ----------
    scene : TriangleMesh, or vertices (n, 3) float64 and faces (m, 3) int64
        In the relief frame: x to the right, y up, z to the viewer.
    views : sequence of (yaw, pitch)
        Degrees to the right and above.
    size : int
        Width and height of the pictures in pixels.

    Raises
    ------
    MeshError
        A mesh without triangles, with vertices that are not finite, or without any extent in x and y.
    ParameterError
        A size or views that cannot be used.

    Examples
    --------
    >>> import open3d as o3d
    >>> ball = o3d.geometry.TriangleMesh.create_sphere()
    >>> Yardstick(ball, size=64).measure(ball).mean_angle
    0.0
    """

    def __init__(
        self, scene: Surface, *, views: Sequence[tuple[float, float]] = SEVEN_VIEWS, size: int = 512
    ) -> None:
        self._size = check_whole("size", size, 8, 8192)
        self._views = check_views("views", views)
        vertices, faces, self._used, self._count = _arrays(scene)
        low, high = vertices.min(axis=0), vertices.max(axis=0)
        self._unit = float((high - low)[:2].max()) / RELIEF_UNITS
        if self._unit == 0.0:
            raise MeshError("The scene is seen edge-on, as a point: there is nothing to compare.")
        self._scene = Body(vertices / self._unit, faces, (low + high)[:2] / 2 / self._unit)
        self._reach = np.abs(self._scene.vertices - self._scene.target).max(axis=0)
        self._shots = [self._scene.shoot(view, self._reach, size) for view in self._views]
        self._pairs: Pairs | None = None
        self._pictures: list[Picture] = []

    @property
    def scene_depth(self) -> float:
        """The scene's visible depth, in its unit."""
        return self._scene.depth * self._unit

    def measure(
        self, relief: Surface, *, heights: NDArray[np.float64] | None = None, similarity: bool = False
    ) -> ReliefQuality:
        """Measure a relief of the scene.

        Parameters
        ----------
        relief : TriangleMesh, or vertices and faces
            In the scene's frame and unit, S at z = 0.
        heights : (n,) float64, optional
            The new z of each vertex of the scene before the cut at S, where it is known: tells what has
            changed places and what lies behind S.
        similarity : bool
            Also compare pictures, which takes a second or two for each; needs scikit-image.

        Returns
        -------
        ReliefQuality

        Raises
        ------
        MeshError
            A mesh without triangles, or with vertices that are not finite.
        ParameterError
            Heights that are not one finite number for each vertex of the scene.
        """
        vertices, faces, _, _ = _arrays(relief)
        body = Body(vertices / self._unit, faces, self._scene.target[:2])
        shots = [body.shoot(view, self._reach, self._size) for view in self._views]
        both = list(zip(self._shots, shots, strict=True))
        found, kept = self._discontinuities(body)
        tested, inverted, visible, behind = self._order(heights)
        return ReliefQuality(
            views=self._views,
            normal_angles=tuple(normal_angle(one, other) for one, other in both),
            silhouette_overlaps=tuple(overlap(one, other) for one, other in both),
            similarities=self._similarities(body) if similarity else None,
            discontinuities=found,
            discontinuities_kept=kept,
            pairs_tested=tested,
            order_inversions=inverted,
            visible_tested=visible,
            visible_behind=behind,
            scene_depth=self.scene_depth,
            depth=float(vertices[:, 2].max()),
        )

    def _discontinuities(self, relief: Body) -> tuple[int, float]:
        """Count the frontal picture's depth discontinuities, and find the share that the relief keeps."""
        if self._scene.depth <= _SAME:
            return 0, float("nan")
        front = (0.0, 0.0)
        before = self._scene.shoot(front, self._reach, self._size)
        camera = self._scene.camera(front, self._reach, self._size)
        high, low = discontinuities(self._scene, camera, before, _JUMP * self._scene.depth)
        if len(high) == 0:
            return 0, float("nan")
        after = relief.shoot(front, self._reach, self._size).height.ravel()
        jump = before.height.ravel()[high] - before.height.ravel()[low]
        ratio = relief.depth / self._scene.depth
        left = after[high] - after[low]  # NaN, where the relief has a hole, is not kept
        kept = (left >= _KEPT * ratio * jump) & (left > 0.0)
        return len(high), float(kept.mean())

    def _order(
        self, heights: NDArray[np.float64] | None
    ) -> tuple[int | None, int | None, int | None, int | None]:
        """Count pairs and those inverted, visible vertices and those behind S."""
        if heights is None:
            return None, None, None, None
        z = as_numbers("heights", heights)
        if z.shape != (self._count,) or not np.isfinite(z[self._used]).all():
            raise ParameterError(
                f"heights must be {self._count} finite numbers, one for each vertex of the scene. "
                f"Got the shape {z.shape} instead."
            )
        z = z[self._used] / self._unit
        if self._pairs is None:
            lines = Lines(self._scene.vertices, self._scene.faces)
            self._pairs = Pairs.join([vertex_pairs(lines), grid_pairs(lines)])
        upper, lower = self._pairs.heights(z)
        # What ends behind S is cut off: it is in nobody's way.
        inverted = (upper < lower - _SAME) & (np.maximum(upper, lower) > 0.0)
        visible = self._scene.visible
        return len(upper), int(inverted.sum()), int(visible.sum()), int((z[visible] < -_SAME).sum())

    def _similarities(self, relief: Body) -> tuple[float, ...]:
        """Return the SSIM of scene and relief in each view."""
        found = []
        for number, view in enumerate(self._views):
            if number == len(self._pictures):
                self._pictures.append(self._scene.picture(view, self._reach, self._size))
            found.append(ssim(self._pictures[number], relief.picture(view, self._reach, self._size)))
        return tuple(found)


def measure_relief(
    scene: Surface,
    relief: Surface | Relief,
    *,
    heights: NDArray[np.float64] | None = None,
    similarity: bool = False,
    views: Sequence[tuple[float, float]] = SEVEN_VIEWS,
    size: int = 512,
) -> ReliefQuality:
    """Measure how much a relief keeps of its scene, see `Yardstick`.

    Parameters
    ----------
    scene : TriangleMesh, or vertices (n, 3) float64 and faces (m, 3) int64
        As it was given to `make_relief` where `relief` is a `Relief`; else it must lie in the relief frame,
        as the relief does: ``scene.transform(np.linalg.inv(relief.to_scene))``.
    relief : Relief, or a surface as `scene`
    heights, similarity
        See `Yardstick.measure`.
    views, size
        See `Yardstick`.

    Returns
    -------
    ReliefQuality

    Raises
    ------
    MeshError, ParameterError
        As `Yardstick` and its `measure`.

    Examples
    --------
    >>> ball = o3d.geometry.TriangleMesh.create_sphere()
    >>> measure_relief(ball, ball, size=64).silhouette_overlaps[0]
    1.0
    """
    if isinstance(relief, Relief):
        vertices, faces = mesh_arrays(_mesh_of(scene) if isinstance(scene, tuple) else scene)
        to_relief = np.linalg.inv(relief.to_scene)
        scene = vertices @ to_relief[:3, :3].T + to_relief[:3, 3], faces
        relief = relief.mesh
    return Yardstick(scene, views=views, size=size).measure(relief, heights=heights, similarity=similarity)


def _mesh_of(surface: tuple[NDArray[np.float64], NDArray[np.int64]]) -> o3d.geometry.TriangleMesh:
    if len(surface) != 2:
        raise MeshError(f"A surface as arrays is vertices and faces. Got {len(surface)} arrays instead.")
    return arrays_mesh(*surface)


def _arrays(
    surface: Surface,
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.int64], int]:
    """Return vertices that faces use, faces, the vertices' numbers in the input and how many it has."""
    if isinstance(surface, tuple):
        surface = _mesh_of(surface)
    vertices, faces = mesh_arrays(surface)
    used, numbered = np.unique(faces, return_inverse=True)
    return vertices[used], numbered.reshape(faces.shape), used, len(vertices)
