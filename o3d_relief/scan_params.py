"""What the user chooses for a point cloud: how it becomes a surface."""

from __future__ import annotations

from dataclasses import dataclass

from o3d_relief.errors import ParameterError
from o3d_relief.param_checks import Triple, check_positive, check_range, check_triple, check_whole

__all__ = ["ScanParams"]


@dataclass(frozen=True, kw_only=True)
class ScanParams:
    """How a point cloud is meshed.

    A *spacing* is the side of the square that one point stands for, the median over the cloud.

    Parameters
    ----------
    sensor : three numbers, optional
        Where the scanner stood, in the cloud's frame and unit: every normal is turned towards it.
    remove_ground : bool
        Remove the floor or the table on which the object stands: a plane across the view's `up`, and
        everything below it.
    file_normals : bool
        Use the normals of the cloud once they are checked; False: always estimate new ones.
    depth : int, optional
        Depth of the Poisson octree: the cells are 1.1 extents / 2^depth wide. None: cells about as wide
        as the spacing.
    max_points : int
        A larger cloud is thinned to about as many points, which bounds memory: 3 GB for the default.
    outliers : float, optional
        Points are dropped whose mean distance to their neighbours lies so many standard deviations above
        that of the others, in logarithms. None: keep all.
    max_hole : float
        Holes of the scan up to this width, in spacings, are closed. All other surface that no point
        supports is cut away.
    min_part : float
        Separate parts with less than this share of the area of the largest one are dropped; 1 leaves the
        largest part alone.
    threads : int
        Threads of the Poisson reconstruction. With one, the same cloud gives the same bytes; with more,
        Open3D numbers the vertices in another order in each run and rounds them differently.
    seed : int
        Seed of the search for the ground.

    Raises
    ------
    ParameterError
        A value out of its range.

    Examples
    --------
    >>> ScanParams(sensor=(0, 0, 2)).sensor
    (0.0, 0.0, 2.0)
    """

    sensor: Triple | None = None
    remove_ground: bool = False
    file_normals: bool = True
    depth: int | None = None
    max_points: int = 1_000_000
    outliers: float | None = 4.0
    max_hole: float = 10.0
    min_part: float = 0.01
    threads: int = 1
    seed: int = 0

    def __post_init__(self) -> None:
        set_field = object.__setattr__
        if self.sensor is not None:
            set_field(self, "sensor", check_triple("sensor", self.sensor))
        for name in ("remove_ground", "file_normals"):
            if not isinstance(getattr(self, name), bool):
                raise ParameterError(f"{name} must be True or False. Got {getattr(self, name)!r} instead.")
        if self.depth is not None:
            set_field(self, "depth", check_whole("depth", self.depth, 3, 13))
        set_field(self, "max_points", check_whole("max_points", self.max_points, 1000, 2**31 - 1))
        if self.outliers is not None:
            set_field(self, "outliers", check_positive("outliers", self.outliers))
        set_field(self, "max_hole", check_range("max_hole", self.max_hole, 0.0))
        set_field(self, "min_part", check_range("min_part", self.min_part, 0.0, 1.0))
        set_field(self, "threads", check_whole("threads", self.threads, 1, 1024))
        set_field(self, "seed", check_whole("seed", self.seed, 0, 2**32 - 1))
