"""Make the built-in scene: an octopus that reaches into an amphora, under a rock arch.

Every part is an implicit surface (negative inside, about a distance in units near its surface) sampled on
one grid; smooth unions join the parts, marching cubes gives the mesh. x points right, y up, z to the viewer.

    python data_scripts/make_demo_scene.py [OUTPUT.npz]
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import open3d as o3d
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline, PchipInterpolator
from scipy.ndimage import binary_dilation, gaussian_filter, gaussian_filter1d, map_coordinates
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree
from skimage.measure import marching_cubes

Array = NDArray[np.float64]
Triple = tuple[float, float, float]

OUTPUT = Path(__file__).parents[1] / "o3d_relief" / "data" / "demo_scene.npz"
VOXEL = 0.62
FACES = 184_000  # after decimation
POSITION_STEP = 1 / 128  # units: an eightieth of the grid's spacing
FAR = 12.0  # the value of a field outside the window in which its part was evaluated
FEWEST_VERTICES, MOST_VERTICES = 40_000, 100_000

HEAD = np.array([11.0, 45.0, 10.0])
ROOT = np.array([11.0, 37.0, 9.0])  # where the arms meet
AMPHORA_FOOT = np.array([-11.0, 4.0, 0.0])
AMPHORA_TOP = np.array([-24.0, 73.0, 2.0])


# ---------------------------------------------------------------------------------------------- the grid


@dataclass(frozen=True)
class Grid:
    """Axis-aligned samples; the spacing may differ along each axis."""

    x: Array
    y: Array
    z: Array

    @property
    def shape(self) -> tuple[int, int, int]:
        """Return the number of samples along each axis."""
        return (len(self.x), len(self.y), len(self.z))

    def points(self) -> Array:
        """Return the position of every sample."""
        return np.stack(np.meshgrid(self.x, self.y, self.z, indexing="ij"), axis=-1)

    def window(self, low: Array, high: Array) -> tuple[tuple[slice, slice, slice], Array]:
        """Return the slices of the samples in a box, and their points."""
        cut = tuple(
            slice(int(np.searchsorted(axis, a)), int(np.searchsorted(axis, b)))
            for axis, a, b in zip((self.x, self.y, self.z), low, high, strict=True)
        )
        part = Grid(self.x[cut[0]], self.y[cut[1]], self.z[cut[2]])
        return (cut[0], cut[1], cut[2]), part.points()

    def far(self) -> Array:
        """Return a field without anything in it."""
        return np.full(self.shape, FAR)


def make_grid() -> Grid:
    """Sample finely where the figures are, coarsely at the back, where only rock is."""

    def axis(low: float, high: float, coarse_below: float = -np.inf) -> Array:
        samples = [high]
        while samples[-1] > low:
            samples.append(samples[-1] - VOXEL * (1 + 0.4 * float(step(coarse_below - samples[-1], 0, 8))))
        return np.array(samples[::-1])

    return Grid(axis(-60, 60), axis(-2, 102, 6), axis(-42, 50, -10))


def noise(grid: Grid, wavelength: float, seed: int) -> Array:
    """Smooth noise of unit variance: a cubic B-spline over a lattice of random numbers."""
    weights = []
    for axis in (grid.x, grid.y, grid.z):
        t = (axis - axis[0]) / wavelength
        distance = np.abs(t[:, None] - np.arange(-1, int(t[-1]) + 3)[None, :])
        weights.append(
            np.where(
                distance < 1,
                2 / 3 - distance**2 + distance**3 / 2,
                np.clip(2 - distance, 0, None) ** 3 / 6,
            )
        )
    values = np.random.default_rng(seed).standard_normal([w.shape[1] for w in weights])
    for w in weights:  # contracts the first axis and appends the new one: three times is all around
        values = np.tensordot(values, w, axes=(0, 1))
    return values / values.std()


# ----------------------------------------------------------------------------------------------- algebra


def smooth_min(a: Array, b: Array, k: float | Array) -> Array:
    """Return the union with a fillet about k wide."""
    return np.minimum(a, b) - 0.25 * np.maximum(k - np.abs(a - b), 0.0) ** 2 / k


def smooth_max(a: Array, b: Array, k: float) -> Array:
    """Return the intersection with a fillet about k wide."""
    return -smooth_min(-a, -b, k)


def bump(x: Array, width: float) -> Array:
    """Return 1 at x = 0, falling to 0 over the width."""
    return np.exp(-((x / width) ** 2))


def step(x: Array | float, low: float, high: float) -> Array:
    """Return 0 below, 1 above, a smooth ramp between."""
    t = np.clip((x - low) / (high - low), 0.0, 1.0)
    return t * t * (3 - 2 * t)


def unit(vector: Array) -> Array:
    """Return the vectors with length 1."""
    return vector / np.linalg.norm(vector, axis=-1, keepdims=True)


# ----------------------------------------------------------------------------------------------- tubes


@dataclass(frozen=True)
class Tube:
    """A curve, densely sampled, with a radius at every sample."""

    line: Array
    radius: Array

    @property
    def arc(self) -> Array:
        """Return the length of the curve up to every sample."""
        return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(self.line, axis=0), axis=1))])

    @property
    def tangent(self) -> Array:
        """Return the direction of the curve at every sample."""
        return unit(np.gradient(self.line, axis=0))


def through(knots: Array, spacing: float = 0.15) -> Array:
    """Sample the cubic spline through the knots (m, c) evenly; the first three columns are the position."""
    chord = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(knots[:, :3], axis=0), axis=1))])
    curve = CubicSpline(chord, knots)
    fine = curve(np.linspace(0, chord[-1], 4000))
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(fine[:, :3], axis=0), axis=1))])
    at = np.interp(np.linspace(0, arc[-1], int(arc[-1] / spacing)), arc, np.linspace(0, chord[-1], 4000))
    return curve(at)


def tube_field(grid: Grid, tube: Tube, reach: float = 6.0) -> tuple[Array, Array]:
    """Return the distance to the tube and, of each sample, the nearest place on the curve (-1: far)."""
    margin = tube.radius.max() + reach
    cut, points = grid.window(tube.line.min(axis=0) - margin, tube.line.max(axis=0) + margin)
    distance, nearest = KDTree(tube.line).query(points, distance_upper_bound=margin)
    found = np.isfinite(distance)
    field, place = grid.far(), np.full(grid.shape, -1)
    field[cut] = np.where(found, distance - np.append(tube.radius, 0)[nearest], FAR)
    place[cut] = np.where(found, nearest, -1)
    return field, place


# -------------------------------------------------------------------------------------------- the octopus


@dataclass(frozen=True)
class Arm:
    """An arm: knots from the root outwards, then a spiral; `under` is where the suckers look, root to tip."""

    knots: tuple[Triple, ...]
    curl: Triple  # where the spiral turns to
    radii: tuple[float, float]  # of the spiral, first and last
    turns: float
    under: tuple[Triple, ...]
    lift: float = 0.0  # sideways travel of the spiral, per radian
    thickness: float = 5.3

    def tube(self) -> Tube:
        """Return the arm's centre line and its thickness."""
        line = through(np.array(self.knots))
        angles = np.linspace(0, 2 * np.pi * self.turns, int(40 * self.turns) + 2)
        radii = np.linspace(*self.radii, len(angles))
        forward = unit(line[-1] - line[-2])
        side = unit(np.array(self.curl) - (np.array(self.curl) @ forward) * forward)
        across = np.cross(forward, side)
        heading = np.cos(angles)[:, None] * forward + np.sin(angles)[:, None] * side
        steps = (heading * radii[:, None] + self.lift * across) * (angles[1] - angles[0])
        line = through(np.vstack([line[::20], line[-1] + np.cumsum(steps, axis=0)]))
        t = np.linspace(0, 1, len(line))
        return Tube(line, 1.35 + (self.thickness - 1.35) * (1 - t) ** 1.15)


ARMS = (
    # across the amphora's belly, then free at its left
    Arm(
        ((6, 38, 13), (-5, 35, 18.5), (-17, 32, 19.5), (-29, 33, 15), (-37, 40, 11)),
        curl=(0.5, 0.6, 0.4),
        radii=(9, 3.2),
        turns=1.15,
        lift=0.8,
        under=((0, -1, 0.5), (0, -1, 0.6), (0.3, 0.3, 1), (0.3, 0, 1)),
    ),
    # up past the handle, over the lip and into the mouth
    Arm(
        ((3, 41, 9), (-4, 51, 13), (-5.5, 63, 14), (-7, 76, 11), (-14, 85, 7), (-22, 83, 4), (-24, 74, 2)),
        curl=(0.2, -1, 0),
        radii=(60, 60),
        turns=0.03,
        under=((-1, 0, 0.4), (-1, 0, 0.6), (-1, -0.5, 0.6), (0, -1, 0.4)),
        thickness=4.6,
    ),
    # the one that reaches out to the viewer
    Arm(
        ((14, 35, 15), (19, 26, 25), (25, 24, 34), (31, 30, 39)),
        curl=(-0.8, 0.5, 0.1),
        radii=(11, 3.1),
        turns=1.35,
        lift=-0.4,
        under=((0, -1, 0.3), (0, -0.6, 0.8), (0, 0, 1), (0, 0.1, 1)),
    ),
    # out to the right and up
    Arm(
        ((18, 39, 10), (27, 37, 14), (36, 41, 16), (43, 50, 16)),
        curl=(-1, 0.6, 0.1),
        radii=(11, 5),
        turns=0.8,
        lift=1.0,
        under=((0, -1, 0.5), (0, -0.8, 0.8), (0, 0, 1), (0, 0, 1)),
    ),
    # down over the rocks at the right
    Arm(
        ((17, 36, 12), (25, 27, 19), (29, 15, 23), (36, 8.5, 22)),
        curl=(0.1, 0.5, 0.8),
        radii=(8, 4.5),
        turns=0.7,
        lift=-0.8,
        under=((0, -1, 0), (-0.5, -1, 0.3), (0, -0.4, 1), (0, 0.6, 1)),
    ),
    # along the ground to the left
    Arm(
        ((7, 36, 14), (1, 25, 21), (-7, 14, 25), (-18, 9.5, 27), (-29, 11, 27), (-37, 17, 24)),
        curl=(0.5, 0.7, 0.2),
        radii=(8.5, 3.3),
        turns=0.85,
        lift=0.7,
        under=((0, -1, 0.2), (0, -1, 0.6), (0, -0.3, 1), (0.3, 0.3, 1)),
    ),
    # back to the arch and up its right leg
    Arm(
        ((17, 40, 5), (26, 43, -3), (34, 51, -12), (38, 62, -15), (33, 72, -16)),
        curl=(-1, 0.1, 0.3),
        radii=(9, 3.4),
        turns=0.8,
        lift=0.8,
        under=((0, -1, 0), (0.5, -0.5, 0.6), (-1, 0, 0.6), (-0.5, 0, 1)),
    ),
    # down the front, along the ground
    Arm(
        ((12, 35, 15), (12, 22, 25), (8, 12, 31), (0, 8, 35), (-9, 10, 37)),
        curl=(0.4, 1, 0.1),
        radii=(7, 2.9),
        turns=1.3,
        lift=0.6,
        under=((0, -1, 0.2), (0, -0.7, 0.7), (0, 0, 1), (0, 0.3, 1)),
    ),
)


def scatter(grid: Grid, spacing: float, rng: np.random.Generator) -> Array:
    """Return random points that fill the grid's box, about one in each cube of the given size."""
    low, high = (np.array([axis[i] for axis in (grid.x, grid.y, grid.z)]) for i in (0, -1))
    return low + rng.random((int(np.prod(high - low) / spacing**3), 3)) * (high - low)


def warts(grid: Grid, body: Array) -> Array:
    """Return the height of the skin's round bumps, larger and smaller as random points lie near the skin."""
    near = np.abs(body) < 2.5
    distance, _ = KDTree(scatter(grid, 2.6, np.random.default_rng(43))).query(grid.points()[near])
    height = np.zeros(grid.shape)
    height[near] = 0.8 * bump(distance, 0.95)
    return height


def mantle(grid: Grid) -> Array:
    """Head and mantle in one piece, the mantle leaning to the right and back."""
    knots = np.array(
        [
            [11, 34, 9, 8.0],
            [11, 41, 10, 9.4],
            [11.2, 48, 9, 9.8],
            [13, 56, 6, 11.4],
            [17, 65, 1.5, 13.8],
            [22.5, 73, -3.5, 13.4],
            [27.5, 78, -7.5, 10.0],
        ]
    )
    samples = through(knots)
    return tube_field(grid, Tube(samples[:, :3], samples[:, 3]))[0]


def arm_field(grid: Grid, arm: Arm) -> tuple[Array, Array, Array]:
    """Return the arm, its suckers, and how far each sample lies on the arm's underside (-1..1)."""
    tube = arm.tube()
    field, place = tube_field(grid, tube)
    hints = np.array(arm.under, dtype=float)
    t = np.linspace(0, 1, len(tube.line))
    tangent = tube.tangent
    bend = gaussian_filter1d(np.gradient(tangent, tube.arc, axis=0), 20, axis=0)
    under = CubicSpline(np.linspace(0, 1, len(hints)), hints)(t) + 3.5 * bend  # curls close on their suckers
    under = unit(under - np.sum(under * tangent, axis=1, keepdims=True) * tangent)
    near = place >= 0
    offset = unit(grid.points()[near] - tube.line[place[near]])
    below = np.zeros(grid.shape)
    below[near] = np.sum(offset * under[place[near]], axis=1)
    field[near] += 0.14 * tube.radius[place[near]] * np.clip(below[near], 0, None) ** 2  # a flatter underside
    return field, suckers(grid, tube, under), below


def suckers(grid: Grid, tube: Tube, under: Array) -> Array:
    """Two rows of rings along the underside, shrinking with the arm."""
    field = grid.far()
    arc, side = tube.arc, np.cross(tube.tangent, under)
    at, sign = 9.0, 1.0
    while at < arc[-1] - 1.0:
        i = int(np.searchsorted(arc, at))
        radius = tube.radius[i]
        size = max(0.42 * radius, 0.8)
        normal = unit(under[i] + 0.55 * sign * side[i])
        centre = tube.line[i] + normal * radius * 0.97
        cut, points = grid.window(centre - size - 2, centre + size + 2)
        offset = points - centre
        height = offset @ normal
        away = np.linalg.norm(offset - height[..., None] * normal, axis=-1)
        ring = np.hypot(away - 0.62 * size, height - 0.12 * size) - 0.40 * size
        field[cut] = np.minimum(field[cut], ring)
        at += 1.08 * size
        sign = -sign
    return field


def eyes(grid: Grid, body: Array) -> tuple[Array, Array, Array]:
    """Add lids and brows to the body; return it with the eyeballs and the pupils."""
    points = grid.points()
    balls, pupils = grid.far(), grid.far()
    for side in (-1.0, 1.0):
        look = unit(np.array([0.55 * side - 0.1, 0.0, 1.0]))
        up = unit(np.array([0.0, 1.0, 0.0]) - look[1] * look)
        across = np.cross(up, look)
        centre = HEAD + np.array([7.6 * side, 4.6, 5.2])
        offset = points - centre
        ahead, height, width = offset @ look, offset @ up, offset @ across
        body = smooth_min(body, np.linalg.norm(offset, axis=-1) - 4.2, 3.5)  # the mound that carries the eye
        angle = np.linspace(-0.12 * np.pi, 1.12 * np.pi, 60)[:, None]
        arc = centre + 2.6 * look + 4.3 * np.cos(angle) * across + (3.3 * np.sin(angle) + 0.7) * up
        brow = tube_field(grid, Tube(arc, 0.9 + 1.1 * np.sin(np.linspace(0, np.pi, 60))))[0]
        body = smooth_min(body, brow, 1.6)
        angle = np.linspace(1.05 * np.pi, 1.95 * np.pi, 60)[:, None]
        arc = centre + 2.6 * look + 4.3 * np.cos(angle) * across + 3.6 * np.sin(angle) * up
        body = smooth_min(body, tube_field(grid, Tube(arc, np.full(60, 0.8)))[0], 1.4)
        balls = np.minimum(balls, np.linalg.norm(offset - 2.2 * look, axis=-1) - 3.9)
        pupil = np.hypot(np.clip(np.abs(width) - 1.5, 0, None), height) - 0.85  # a lying slit
        pupils = np.minimum(pupils, np.where(ahead > 0, pupil, FAR))
    return body, balls, pupils


def siphon(grid: Grid) -> Array:
    """Return the short funnel below the left eye."""
    knots = np.array([[5, 43, 15, 3.6], [2.6, 40.2, 19.5, 3.1], [1.6, 40.0, 23.0, 2.9]])
    samples = through(knots)
    outer = tube_field(grid, Tube(samples[:, :3], samples[:, 3]))[0]
    inner = np.linalg.norm(grid.points() - (samples[-1, :3] + [-0.3, 0.1, 2.2]), axis=-1) - 2.0
    return smooth_max(outer, -inner, 1.2)


# -------------------------------------------------------------------------------------------- the amphora

PROFILE = np.array(
    [
        [0, 4.6], [1.6, 5.4], [3.4, 4.3], [6, 5.2], [14, 10.2], [24, 13.6], [34, 14.8], [42, 13.6],
        [48, 10.4], [52, 7.6], [56, 6.6], [62, 6.4], [65, 7.0], [66.5, 8.8], [68.5, 9.4], [70, 9.0],
    ]
)  # fmt: skip
RINGS = (7.5, 22.0, 26.0, 35.8, 45.4, 49.6, 53.2, 60.6)


def amphora_frame(points: Array) -> tuple[Array, Array, Array]:
    """Return height along the axis, distance from it, and angle around it (0: the right handle)."""
    axis = unit(AMPHORA_TOP - AMPHORA_FOOT)
    right = unit(np.array([1.0, 0.0, 0.25]) - (axis[0] + 0.25 * axis[2]) * axis)
    offset = points - AMPHORA_FOOT
    height = offset @ axis
    a, b = offset @ right, offset @ np.cross(axis, right)
    return height, np.hypot(a, b), np.arctan2(b, a)


def amphora(grid: Grid) -> tuple[Array, Array]:
    """Return the amphora, and the paint on it (0..1)."""
    height, away, angle = amphora_frame(grid.points())
    profile = PchipInterpolator(*PROFILE.T)
    h = np.clip(height, 0, 70)
    slope = np.sqrt(1 + profile(h, 1) ** 2)
    radius = profile(h)
    groove = sum(bump(height - ring, 0.7) for ring in RINGS)
    wave = 40.6 + 2.4 * np.sin(9 * angle)
    line = (height - wave) / np.hypot(1, 1.5 * np.cos(9 * angle))  # about the distance to the wave
    groove = np.maximum(groove, bump(line, 0.85))
    rays = bump((np.mod(angle * 12 / (2 * np.pi), 1) - 0.5) * 2 * np.pi * radius / 12, 0.85)
    groove = np.maximum(groove, rays * step(height, 8, 9.5) * (1 - step(height, 18, 20)))
    body = (away - radius + 0.75 * groove) / slope
    body = smooth_max(body, np.maximum(height - 70, -height), 1.2)
    cavity = np.maximum((away - radius + 2.4) / slope, 46 - height)
    body = smooth_max(body, -cavity, 0.8)
    for handle in handles():
        body = smooth_min(body, tube_field(grid, handle)[0], 1.6)
    paint = step(height, 45.1, 45.5) * (1 - step(height, 49.5, 49.9))
    paint += step(height, 21.7, 22.1) * (1 - step(height, 25.9, 26.3))
    paint += step(height, 64.6, 65.2) + (1 - step(height, 7.2, 7.6))
    paint += np.where((height > 36) & (height < 45), bump(line, 1.1), 0)
    paint += rays * step(height, 8, 9.5) * (1 - step(height, 18, 20))
    return body, np.clip(paint, 0, 1) * (away < radius + 0.9)


def handles() -> list[Tube]:
    """Two loops from below the lip to the shoulder."""
    axis = unit(AMPHORA_TOP - AMPHORA_FOOT)
    right = unit(np.array([1.0, 0.0, 0.25]) - (axis[0] + 0.25 * axis[2]) * axis)
    loops = []
    for side in (-1.0, 1.0):
        knots = np.array([[5.5, 61.5], [10.5, 64.2], [15.2, 61.5], [16.0, 54.5], [13.6, 47.5], [11.2, 43.5]])
        line = through(AMPHORA_FOOT + side * knots[:, :1] * right + knots[:, 1:] * axis)
        loops.append(Tube(line, np.linspace(1.9, 2.2, len(line))))
    return loops


# ------------------------------------------------------------------------------------------------- rock


def boulder(points: Array, centre: Triple, radii: Triple, seed: int) -> Array:
    """Return a stone with flat faces, the intersection of half-spaces."""
    directions = unit(np.random.default_rng(seed).standard_normal((22, 3)))
    offset = (points - np.array(centre)) / np.array(radii)
    field = np.full(points.shape[:-1], -np.inf)
    for direction in directions:
        field = np.maximum(field, offset @ direction - 0.86)
    return np.maximum(field, np.linalg.norm(offset, axis=-1) - 1.0) * min(radii)


BOULDERS = (
    ((14, 10, 4), (21, 22, 14), 1),
    ((27, 6, 8), (15, 14, 14), 2),
    ((3, 6, 10), (14, 14, 11), 3),
    ((-14, 3, -4), (17, 9, 14), 4),
    ((-38, 3, 12), (10, 8, 9), 5),
    ((40, 2, 10), (9, 9, 9), 6),
    ((-30, 2, 22), (7, 5, 6), 7),
    ((18, 2, 33), (8, 6, 7), 8),
    ((-39, 8, -20), (13, 15, 13), 9),
    ((38, 8, -18), (13, 18, 12), 10),
    ((-12, 1, 33), (5, 5, 5), 11),
    ((36, 0, 33), (6, 6, 5), 12),
)
ARCH = np.array(
    [
        [-39, -4, -22, 9.0],
        [-40, 20, -23, 8.0],
        [-37, 46, -25, 7.0],
        [-28, 70, -26, 7.5],
        [-8, 86, -26, 6.5],
        [14, 88, -26, 6.0],
        [31, 75, -25, 6.5],
        [38, 48, -23, 7.5],
        [39, 20, -21, 8.0],
        [38, -4, -20, 9.0],
    ]
)


def boulder_field(grid: Grid, centre: Triple, radii: Triple, seed: int) -> Array:
    """Return one boulder, evaluated near it only."""
    reach = np.array(radii) + 6
    cut, points = grid.window(np.array(centre) - reach, np.array(centre) + reach)
    field = grid.far()
    field[cut] = np.minimum(boulder(points, centre, radii, seed), FAR)
    return field


def facets(grid: Grid, field: Array, spacing: float, seed: int) -> Array:
    """Break a rock into blocks: each cell around a random point is moved and tilted a little."""
    rng = np.random.default_rng(seed)
    seeds = scatter(grid, spacing, rng)
    count = len(seeds)
    shift, tilt = 0.065 * spacing * rng.standard_normal(count), 0.24 * unit(rng.standard_normal((count, 3)))
    near = np.abs(field) < 8
    points = grid.points()[near]
    distance, cell = KDTree(seeds).query(points, k=2)
    first = shift[cell[:, 0]] + np.sum(tilt[cell[:, 0]] * (points - seeds[cell[:, 0]]), axis=1)
    crack = 0.8 * bump(distance[:, 1] - distance[:, 0], 0.8)
    broken = field.copy()
    broken[near] += np.clip(first, -0.8, 2.0) + crack  # much growth would make spurs
    return gaussian_filter(broken, 0.5 / VOXEL)


def arch(grid: Grid) -> Array:
    """Return the arch, before it is broken into blocks."""
    samples = through(ARCH)
    field = tube_field(grid, Tube(samples[:, :3], samples[:, 3] + 0.8))[0]
    return field + 0.8 * noise(grid, 13, 23)


def rock(grid: Grid) -> Array:
    """Ground, boulders and the arch, broken into blocks and roughened together."""
    points = grid.points()
    x, y, z = points[..., 0], points[..., 1], points[..., 2]
    outline = (np.abs(x / 47) ** 2.6 + np.abs((z - 4) / 36) ** 2.6) ** (1 / 2.6)
    top = y - 5.0 - 1.1 * noise(grid, 11, 21)
    field = smooth_max(top, 30 * (outline - 1 + 0.03 * noise(grid, 8, 22)), 4.0)
    for centre, radii, seed in BOULDERS:
        field = smooth_min(field, boulder_field(grid, centre, radii, seed), 2.0)
    field = smooth_min(field, arch(grid), 3.0)
    field = facets(grid, field, 9.0, 24) + 0.3 * noise(grid, 3.0, 25)
    return np.maximum(field, 0.12 * noise(grid, 5, 28) - y)


def barnacles(grid: Grid, stone: Array) -> Array:
    """Small cones with a crater, in colonies on the stone that looks to the viewer."""
    slope = np.stack(np.gradient(stone, grid.x, grid.y, grid.z), axis=-1)
    points = grid.points()
    colony = noise(grid, 13, 51) > 0.8
    rows = np.argwhere((np.abs(stone) < 0.4) & (slope[..., 2] > 0.1) & colony & (points[..., 1] > 9))
    rows = rows[np.random.default_rng(52).permutation(len(rows))]
    field, placed = grid.far(), np.empty((0, 3))
    for row in rows:
        centre, normal = points[tuple(row)], unit(slope[tuple(row)])
        if len(placed) == 32:
            break
        if len(placed) and np.linalg.norm(placed - centre, axis=1).min() < 4.4:
            continue
        placed = np.vstack([placed, centre])
        size = 2.0 + 0.5 * np.sin(9.0 * len(placed))
        cut, near = grid.window(centre - 5, centre + 5)
        height = (near - centre) @ normal
        away = np.linalg.norm(near - centre - height[..., None] * normal, axis=-1)
        cone = smooth_max((away - size + 0.6 * height) * 0.85, np.abs(height) - 0.8 * size, 0.5)
        cone = np.maximum(cone, 0.42 * size - np.hypot(away, height - 0.95 * size))
        field[cut] = np.minimum(field[cut], cone)
    return field


# -------------------------------------------------------------------------------------------- small things


def starfish(grid: Grid, centre: Triple, up: Triple, size: float, turn: float) -> Array:
    """Five tapering rays with a row of knobs each."""
    normal = unit(np.array(up, dtype=float))
    first = unit(np.cross(normal, [0.3, 0.2, 1.0]))
    second = np.cross(normal, first)
    field = grid.far()
    for i in range(5):
        angle = turn + 2 * np.pi * i / 5
        along = np.cos(angle) * first + np.sin(angle) * second
        t = np.linspace(0, 1, 60)[:, None]
        line = np.array(centre) + size * t * along + 0.12 * size * np.sin(3 * t) * np.cross(normal, along)
        radius = (0.25 - 0.1 * t[:, 0]) * size + 0.15 * np.cos(2 * np.pi * 4.0 * t[:, 0])
        field = smooth_min(field, tube_field(grid, Tube(line, radius))[0], 0.8)
    return field


def scallop(grid: Grid, centre: Triple, up: Triple, size: float) -> Array:
    """Return a fan shell, a flat dome with ribs from the hinge."""
    normal = unit(np.array(up, dtype=float))
    first = unit(np.cross(normal, [1.0, 0.2, 0.0]))
    second = np.cross(normal, first)
    cut, points = grid.window(np.array(centre) - 2 * size, np.array(centre) + 2 * size)
    offset = points - np.array(centre)
    a, b, h = offset @ first, offset @ second, offset @ normal
    fan = np.arctan2(b, a + size)
    ribs = 0.25 * np.cos(fan * 14) * step(np.hypot(a + size, b), 0.5 * size, 1.1 * size)
    field = grid.far()
    field[cut] = (np.sqrt(a**2 + b**2 + (h / 0.55) ** 2) - size) * 0.6 - ribs
    return field


def snail(grid: Grid, tip: Triple, mouth: Triple, size: float) -> Array:
    """Return a turret shell, whorls that wind around a straight axis."""
    start, end = np.array(tip, dtype=float), np.array(mouth, dtype=float)
    axis = unit(end - start)
    first = unit(np.cross(axis, [0.2, 1.0, 0.1]))
    second = np.cross(axis, first)
    t = np.linspace(0, 1, 400)[:, None]
    angle = 2 * np.pi * 4.5 * t
    line = start + (end - start) * t + 0.45 * size * t * (np.cos(angle) * first + np.sin(angle) * second)
    return tube_field(grid, Tube(line, 0.7 + 0.62 * size * t[:, 0]))[0]


# ---------------------------------------------------------------------------------------------- the scene


def build(grid: Grid) -> tuple[Array, list[tuple[Array, Array]]]:
    """Return the whole field, and the parts as (field, colour (..., 3)) pairs."""
    mottle = np.clip(0.5 + 0.35 * noise(grid, 6, 41) + 0.15 * noise(grid, 2.5, 42), 0, 1)
    reach = np.linalg.norm(grid.points() - ROOT, axis=-1)
    web = 1.6 + 6.0 * bump(reach, 13.0)
    body, discs, below = mantle(grid), grid.far(), np.full(grid.shape, -1.0)
    for arm in ARMS:
        field, rings, underside = arm_field(grid, arm)
        below = np.where(field < body, underside, below)
        body = smooth_min(body, field, web)
        discs = np.minimum(discs, rings)
    body = smooth_min(body, siphon(grid), 1.5)
    skin = warts(grid, body) + 0.25 * noise(grid, 6, 44)
    body = body - skin * (1 - step(below, 0.0, 0.5)) * step(reach, 4, 12)
    body, balls, pupils = eyes(grid, body)
    pot, paint = amphora(grid)
    stone = rock(grid)
    crust = barnacles(grid, stone)
    star = np.minimum(
        starfish(grid, (-23, 8.6, 34.5), (0, 1, 1.0), 8.0, 0.4),
        starfish(grid, (36, 30, -13.5), (-0.1, 0.1, 1), 6.0, 1.0),
    )
    shell = np.minimum(
        np.minimum(
            scallop(grid, (26, 7.5, 36), (0.2, 1, 1.3), 5.2),
            scallop(grid, (-41, 11.5, 15), (-0.2, 1, 1.2), 4.6),
        ),
        snail(grid, (-2, 9.0, 22), (-6, 7.5, 30), 2.6),
    )

    whole = smooth_min(body, discs, 0.5)
    whole = np.minimum(whole, balls)
    whole = whole + 0.7 * (1 - step(pupils, -0.2, 0.3)) * (1 - step(balls, 0.6, 1.0))
    whole = smooth_min(whole, pot, 0.9)
    whole = smooth_min(whole, stone, 1.4)
    for small in (star, shell, crust):
        whole = smooth_min(whole, small, 0.7)

    def colour(*rgb: float) -> Array:
        return np.array(rgb) / 255.0

    def mix(a: Array, b: Array, t: Array) -> Array:
        return a + t[..., None] * (b - a)

    flesh = mix(
        mix(colour(128, 48, 44), colour(196, 92, 66), mottle), colour(222, 166, 138), step(below, 0.3, 0.75)
    )
    eye = mix(colour(222, 184, 92), colour(28, 20, 20), 1 - step(pupils, -0.15, 0.35))
    sand = step(np.gradient(stone, grid.y, axis=1), 0.55, 0.9) * (1 - step(grid.points()[..., 1], 7, 13))
    grey = mix(mix(colour(92, 102, 90), colour(140, 142, 124), mottle), colour(186, 172, 140), 0.8 * sand)
    parts = [
        (body, flesh),
        (discs, np.broadcast_to(colour(238, 212, 190), flesh.shape)),
        (balls, eye),
        (pot, mix(mix(colour(186, 104, 62), colour(206, 132, 86), mottle), colour(66, 42, 38), paint)),
        (stone, grey),
        (star, np.broadcast_to(colour(214, 120, 62), flesh.shape)),
        (shell, np.broadcast_to(colour(226, 216, 198), flesh.shape)),
        (crust, np.broadcast_to(colour(186, 180, 160), flesh.shape)),
    ]
    return whole, parts


def surface(field: Array) -> tuple[Array, NDArray[np.int64]]:
    """Return the largest closed component of the zero set, with vertices in grid steps."""
    for _ in range(10):
        # Samples almost on the surface would give needles: push them off it.
        least = 0.06 * VOXEL
        field = np.where(np.abs(field) < least, np.where(field < 0, -least, least), field)
        vertices, faces, _, _ = marching_cubes(field.astype(np.float32), 0.0, allow_degenerate=False)
        faces = faces.astype(np.int64)
        edges = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        edges, count = np.unique(edges, axis=0, return_counts=True)
        crowded = np.unique(edges[count > 2])
        if len(crowded) == 0:
            break
        # Two sheets meet in an edge: smooth the field there, which parts or joins them.
        around = np.zeros(field.shape, dtype=bool)
        around[tuple(np.round(vertices[crowded]).astype(int).T)] = True
        around = binary_dilation(around, iterations=2)
        field = np.where(around, gaussian_filter(field, 0.7), field)
    n = len(vertices)
    links = coo_array((np.ones(len(edges)), edges.T), shape=(n, n))
    _, label = connected_components(links, directed=False)
    keep = label == np.argmax(np.bincount(label))
    renumber = np.cumsum(keep) - 1
    return vertices[keep].astype(np.float64), renumber[faces[keep[faces[:, 0]]]]


def relax(vertices: Array, faces: NDArray[np.int64]) -> Array:
    """Taubin smoothing, twice: evens out the triangles, keeps the volume."""
    a, b = faces.reshape(-1), np.roll(faces, 1, axis=1).reshape(-1)
    n = len(vertices)
    links = coo_array((np.ones(len(a)), (a, b)), shape=(n, n)).tocsr()
    degree = links.sum(axis=1)[:, None]
    for weight in (0.4, -0.42) * 2:
        vertices = vertices + weight * (links @ vertices / degree - vertices)
    return vertices


def decimate(vertices: Array, faces: NDArray[np.int64]) -> tuple[Array, NDArray[np.int64]]:
    """Spend the vertices where the detail is: on suckers, eyes and engraving, not on smooth skin."""
    vertices = np.round(vertices * 1024) / 1024  # so that the last bits do not decide which edge goes first
    mesh = o3d.geometry.TriangleMesh(o3d.utility.Vector3dVector(vertices), o3d.utility.Vector3iVector(faces))
    mesh = mesh.simplify_quadric_decimation(FACES)
    return np.array(mesh.vertices), np.array(mesh.triangles, dtype=np.int64)


def paint(vertices: Array, grid: Grid, parts: list[tuple[Array, Array]]) -> Array:
    """Colour each vertex by the parts nearest to it."""
    axes = (grid.x, grid.y, grid.z)
    at = np.stack(
        [np.interp(vertices[:, i], axis, np.arange(len(axis))) for i, axis in enumerate(axes)], axis=1
    )
    weights, colours = [], []
    for field, colour in parts:
        weights.append(np.exp(-np.clip(map_coordinates(field, at.T, order=1), -1, 8) / 0.22))
        colours.append([map_coordinates(colour[..., i], at.T, order=1) for i in range(3)])
    share = np.array(weights) / np.sum(weights, axis=0)
    return np.einsum("pn,pcn->nc", share, np.array(colours))


def check(vertices: Array, faces: NDArray[np.int64]) -> None:
    """Stop unless the mesh is one watertight manifold of the promised size."""
    mesh = o3d.geometry.TriangleMesh(o3d.utility.Vector3dVector(vertices), o3d.utility.Vector3iVector(faces))
    corners = vertices[faces]
    components = len(mesh.cluster_connected_triangles()[1])
    failed = [
        name
        for name, good in {
            f"vertex count {len(vertices)}": FEWEST_VERTICES <= len(vertices) <= MOST_VERTICES,
            f"{components} components": components == 1,
            "not edge-manifold": mesh.is_edge_manifold(allow_boundary_edges=False),
            "not vertex-manifold": mesh.is_vertex_manifold(),
            "inside out": np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) > 0,
        }.items()
        if not good
    ]
    if failed:
        raise SystemExit("The scene is not as promised: " + ", ".join(failed) + ".")


# ---------------------------------------------------------------------------------------------- the file


def pack(path: Path, vertices: Array, faces: NDArray[np.int64], colours: Array) -> None:
    """Write the mesh so that it deflates well; `o3d_relief.scene.demo` reads it.

    Faces are sorted into columns along z, vertices numbered by first use. A corner is stored as how far its
    vertex lies behind the next unused number: 0 is a new vertex. Positions (in steps from the origin) and
    colours (in steps of 4/255) are differences to the vertex before, modulo the range of their type. Numbers
    of two bytes are stored as all low bytes, then all high bytes.
    """
    middle = vertices[faces].mean(axis=1)
    column = np.floor(middle / 4)
    corners = faces[np.lexsort((middle[:, 2], column[:, 1], column[:, 0]))].reshape(-1)
    _, first, inverse = np.unique(corners, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    vertices, colours, corners = vertices[order], colours[order], rank[inverse.reshape(-1)]
    fresh = np.zeros(len(corners), dtype=bool)
    fresh[first] = True
    behind = np.cumsum(fresh) - fresh - corners
    if behind.max() >= 2**16:
        raise SystemExit("The faces jump too far to be packed in two bytes.")
    origin = vertices.min(axis=0)
    position = np.round((vertices - origin) / POSITION_STEP).astype(np.int64)
    shade = np.round(np.clip(colours, 0, 1) * 255 / 4).astype(np.int64)

    def two_bytes(numbers: NDArray[np.int64]) -> NDArray[np.uint8]:
        return np.stack([numbers & 255, numbers >> 8 & 255]).astype(np.uint8)

    path.parent.mkdir(parents=True, exist_ok=True)
    np.savez_compressed(
        path,
        origin=origin,
        step=np.float64(POSITION_STEP),
        positions=two_bytes(np.diff(position, axis=0, prepend=0).T),
        colours=np.diff(shade, axis=0, prepend=0).astype(np.uint8).T,
        corners=two_bytes(behind),
    )


def main() -> None:
    """Make the scene and write it."""
    parser = argparse.ArgumentParser(description="Make the built-in scene.")
    parser.add_argument(
        "output", nargs="?", type=Path, default=OUTPUT, help="file to write (default: %(default)s)"
    )
    output = parser.parse_args().output
    start = time.perf_counter()
    grid = make_grid()
    whole, parts = build(grid)
    at, faces = surface(whole)
    at = relax(at, faces)
    axes = (grid.x, grid.y, grid.z)
    vertices = np.stack(
        [np.interp(at[:, i], np.arange(len(axis)), axis) for i, axis in enumerate(axes)], axis=1
    )
    vertices, faces = decimate(vertices, faces)
    check(vertices, faces)
    pack(output, vertices, faces, paint(vertices, grid, parts))
    print(
        f"{len(vertices)} vertices, {len(faces)} faces, {output.stat().st_size / 1e3:.0f} kB, "
        f"{time.perf_counter() - start:.0f} s: {output}"
    )


if __name__ == "__main__":
    main()
