"""What the user chooses: the view of the scene and the parameters of the relief."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from o3d_relief.errors import ParameterError
from o3d_relief.param_checks import (
    Triple,
    check_beta,
    check_depth,
    check_direction,
    check_indices,
    check_number,
    check_range,
    check_triple,
    check_weights,
    check_whole,
)
from o3d_relief.point_edits import PointEdit, check_edits

__all__ = ["ReliefParams", "Triple", "View"]


def _words(direction: Triple) -> str:
    return ", ".join(f"{c:g}" for c in direction)


@dataclass(frozen=True, kw_only=True)
class View:
    """How the scene is looked at.

    Parameters
    ----------
    front : three numbers or "x", "-x", "y", ...
        Direction from the scene to the viewer, in the input's frame. It becomes the relief's z axis.
    up : three numbers or "x", "-x", "y", ...
        Direction that points up, in the input's frame; only its part across `front` counts.
    viewpoint : three numbers, optional
        The point u that decides what is visible, in the relief frame and in relief units (the larger
        of the scene's x and y extents is 100, the rearmost point lies at z = 0, the centre at x = y = 0).
        It must lie in front of the scene. None: infinitely far.
    vanishing_point : three numbers, optional
        The point g behind the relief plane (z < 0) towards which the scene is drawn (section 3.1), in
        the same frame and unit. None: infinitely far, no deformation.

    Raises
    ------
    ParameterError
        A value that is not a direction or a point, or `up` parallel to `front`.

    Examples
    --------
    >>> View(front="-y", up="z").front
    (0.0, -1.0, 0.0)
    """

    front: Triple | str = (0.0, 0.0, 1.0)
    up: Triple | str = (0.0, 1.0, 0.0)
    viewpoint: Triple | None = None
    vanishing_point: Triple | None = None

    def __post_init__(self) -> None:
        front = check_direction("front", self.front)
        up = check_direction("up", self.up)
        cross = math.hypot(
            front[1] * up[2] - front[2] * up[1],
            front[2] * up[0] - front[0] * up[2],
            front[0] * up[1] - front[1] * up[0],
        )
        if cross <= 1e-9 * math.hypot(*front) * math.hypot(*up):
            raise ParameterError(
                f"up must not be parallel to front ({_words(front)}): give another up, for instance "
                f"{'z' if abs(front[2]) < 0.9 else 'y'}."
            )
        object.__setattr__(self, "front", front)
        object.__setattr__(self, "up", up)
        for name in ("viewpoint", "vanishing_point"):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, check_triple(name, value))
        if self.vanishing_point is not None and self.vanishing_point[2] >= 0.0:
            raise ParameterError(
                "vanishing_point must lie behind the relief plane (z < 0). "
                f"Got z = {self.vanishing_point[2]:g} instead."
            )


_PAPER: dict[str, Any] = {
    "mode": "attenuation",
    "smooth_points": False,
    "in_front": False,
    "in_order": False,
}


_OF_POINTS = (
    "k", "beta", "discard_above", "attach_below", "max_order_error", "blend", "smooth_points", "point_edits",
)  # fmt: skip
"""The parameters that concern the attenuation points."""


@dataclass(frozen=True, kw_only=True)
class ReliefParams:
    """The parameters of the method.

    Parameters
    ----------
    mode : "attenuation", "bounded" or None
        "attenuation" is the paper's method; a `depth` is then met by compression. "bounded" finds the
        relief of exactly the wanted `depth` that changes what is seen of the surface least; it needs a
        `depth`, and of the other parameters it uses `min_gap`, `attach` and `weights`. None: bounded where
        a depth is given.
    k : int
        Number of clusters, and so of attenuation points at most. More points bring more of the scene
        to the plane and lower the depth, at the price of more deformation.
    beta : float or sequence of float
        Attenuation factor of Eq. 3, per relief unit: one number, or one for each attenuation point (each
        cluster). Smaller values let parts stand further out; 0 leaves the differentials as they are.
    discard_above : float
        The paper's t1: points with a relative differential above it are dropped.
    attach_below : float
        The paper's t2: points with a relative differential below it are attached to the relief plane.
    max_order_error : float
        The paper's t3: vertices with a depth order error (Eq. 8) of at least this are solved again.
    blend : float
        The paper's t: share of first order against second order differentials in the restoration.
    alpha : float, optional
        The paper's alpha, the largest compression ratio, in (0, 1]. None: no compression.
    alpha_min : float, optional
        The smallest compression ratio, in (0, alpha]. None: half of the largest.
    depth : float or "25%", ..., optional
        Wanted depth of the relief above the plane, met exactly: in the input's unit, or as a share of the
        depth of what is visible of the scene. A scene, or a relief before its compression, that is
        shallower already is left as it is. Excludes `alpha`.
    smooth_points : bool
        Also restore a disc around every kept attenuation point, which removes the small pimples that
        the paper's own rule (False) leaves there.
    in_front : bool
        Restore whatever is visible and behind the relief plane, too, so that every visible vertex ends in
        front of it. False: the paper's own behaviour, which trims it.
    in_order : bool
        Keep the order of all surfaces along the viewing direction, so that nothing passes through anything,
        and tie the parts of a scene to each other. False: the paper's own behaviour.
    min_gap : float
        Smallest gap along the viewing direction between surfaces one behind the other, in the input's
        unit, so that they do not fuse in print. Gaps that were smaller before stay as they are at least.
        Needs `in_order`.
    attach : sequence of int
        Input vertices that are to lie on the relief plane; bounded mode only.
    weights : sequence of float, optional
        One for each input vertex, greater than 0: how much the surface there is to keep its shape, against 1
        for the rest (10 on a face keeps the face). Bounded mode only.
    seed : int
        Seed of the clustering.
    point_edits : sequence of PointEdit
        Changes of single attenuation points by hand; where two concern the same point, the later counts.
        Without effect in bounded mode, which has no such points.

    Raises
    ------
    ParameterError
        A value out of its range, or two that exclude each other.

    Examples
    --------
    >>> ReliefParams(k=64, depth=12).depth
    12.0
    >>> ReliefParams(depth="25%").bounded
    True
    """

    mode: str | None = None
    k: int = 128
    beta: float | Sequence[float] = 0.2
    discard_above: float = 0.6
    attach_below: float = 0.3
    max_order_error: float = 0.2
    blend: float = 0.9
    alpha: float | None = None
    alpha_min: float | None = None
    depth: float | str | None = None
    smooth_points: bool = True
    in_front: bool = True
    in_order: bool = True
    min_gap: float = 0.0
    attach: Sequence[int] = ()
    weights: Sequence[float] | None = field(default=None, repr=False)
    seed: int = 0
    point_edits: Sequence[PointEdit] = ()

    @classmethod
    def paper(cls, **values: Any) -> ReliefParams:
        """Return the parameters of the published method, without anything that goes beyond it.

        Parameters
        ----------
        **values
            Other parameters by name.

        Examples
        --------
        >>> ReliefParams.paper(k=64).in_order
        False
        """
        return cls(**{**_PAPER, **values})

    def __post_init__(self) -> None:
        set_field = object.__setattr__
        set_field(self, "k", check_whole("k", self.k, 1, 2**31 - 1))
        set_field(self, "beta", check_beta(self.beta))
        for name in ("discard_above", "attach_below", "max_order_error", "blend"):
            set_field(self, name, check_range(name, getattr(self, name), 0.0, 1.0))
        if self.attach_below > self.discard_above:
            raise ParameterError(
                "attach_below must not exceed discard_above. "
                f"Got {self.attach_below:g} and {self.discard_above:g} instead."
            )
        for name in ("smooth_points", "in_front", "in_order"):
            if not isinstance(getattr(self, name), bool):
                raise ParameterError(f"{name} must be True or False. Got {getattr(self, name)!r} instead.")
        set_field(self, "min_gap", check_range("min_gap", self.min_gap, 0.0))
        if self.min_gap > 0.0 and not self.in_order:
            raise ParameterError("min_gap needs in_order: a gap cannot be kept where the order is not.")
        set_field(self, "seed", check_whole("seed", self.seed, 0, 2**32 - 1))
        set_field(self, "point_edits", check_edits(self.point_edits))
        self._check_compression()
        self._check_mode()

    @property
    def bounded(self) -> bool:
        """Whether the relief is made by the bounded mode."""
        return self.mode == "bounded" or (self.mode is None and self.depth is not None)

    @property
    def unused(self) -> tuple[str, ...]:
        """The parameters of the points that are not at their defaults, but without effect in this mode.

        Examples
        --------
        >>> ReliefParams(depth=3, k=64).unused
        ('k',)
        """
        if not self.bounded:
            return ()
        default = type(self)()
        return tuple(name for name in _OF_POINTS if getattr(self, name) != getattr(default, name))

    def settled(self, visible_depth: float) -> ReliefParams:
        """Return the same parameters with a length for a depth that is a share.

        Parameters
        ----------
        visible_depth : float
            Depth of what is visible of the scene, in the input's unit.

        Examples
        --------
        >>> ReliefParams(depth="25%").settled(12.0).depth
        3.0
        """
        if not isinstance(self.depth, str):
            return self
        depth = float(self.depth.removesuffix("%")) / 100.0 * visible_depth
        return replace(self, depth=max(depth, sys.float_info.min))  # a flat scene stays as it is

    def _check_mode(self) -> None:
        if self.mode not in (None, "attenuation", "bounded"):
            raise ParameterError(f'mode must be "attenuation" or "bounded". Got {self.mode!r} instead.')
        object.__setattr__(self, "attach", check_indices("attach", self.attach))
        if self.weights is not None:
            object.__setattr__(self, "weights", check_weights("weights", self.weights))
        if not self.bounded:
            if self.attach or self.weights is not None:
                name = "attach" if self.attach else "weights"
                raise ParameterError(f'{name} needs mode="bounded" and a depth.')
            return
        if self.depth is None:
            raise ParameterError('mode="bounded" needs a depth.')
        if self.alpha_min is not None:
            raise ParameterError('alpha_min needs mode="attenuation": the bounded mode does not compress.')
        if not (self.in_front and self.in_order):
            name = "in_order" if self.in_front else "in_front"
            raise ParameterError(f'{name}=False needs mode="attenuation": the bounded mode always keeps it.')

    def _check_compression(self) -> None:
        if self.alpha is not None and self.depth is not None:
            raise ParameterError("alpha and depth exclude each other: give one of them.")
        if self.depth is not None:
            object.__setattr__(self, "depth", check_depth("depth", self.depth))
        for name in ("alpha", "alpha_min"):
            value = getattr(self, name)
            if value is None:
                continue
            number = check_number(name, value)
            if not 0.0 < number <= 1.0:
                raise ParameterError(f"{name} must be greater than 0 and at most 1. Got {value!r} instead.")
            object.__setattr__(self, name, number)
        if self.alpha_min is not None and self.alpha_min > (1.0 if self.alpha is None else self.alpha):
            raise ParameterError(
                f"alpha_min must not exceed alpha. Got {self.alpha_min:g} and {self.alpha:g} instead."
            )
