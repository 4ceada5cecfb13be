"""Checks of the parameters' values: each returns plain Python, or says what is wrong."""

from __future__ import annotations

import math
from collections.abc import Sequence
from numbers import Integral
from typing import Any, TypeVar

from o3d_relief.errors import ParameterError

__all__ = [
    "Triple",
    "check_beta",
    "check_depth",
    "check_direction",
    "check_indices",
    "check_kind",
    "check_number",
    "check_positive",
    "check_range",
    "check_triple",
    "check_weights",
    "check_whole",
    "given",
    "told",
]

_AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}

Triple = tuple[float, float, float]

_Kind = TypeVar("_Kind")

_LONGEST = 80
"""Characters of a value that are repeated in a sentence."""


def told(value: object) -> str:
    """Return a value as a sentence names it: as it is typed, or by its class where that is long.

    Examples
    --------
    >>> told("5"), told(range(3)), told([0] * 100)
    ("'5'", 'range(0, 3)', 'something of the class list')
    """
    try:
        words = repr(value)
    except ValueError:  # a whole number of more digits than Python writes
        words = "\n"
    if len(words) > _LONGEST or "\n" in words:  # an array, or a whole relief
        return f"something of the class {type(value).__name__}"
    return words


def check_kind(name: str, value: object, kind: type, source: str = "") -> None:
    """Check that something is of a class of this package.

    Parameters
    ----------
    name : str
        What it is called in the sentence.
    value : object
    kind : type
    source : str
        The function that makes one, for the sentence.

    Raises
    ------
    ParameterError
        It is something else.

    Examples
    --------
    >>> check_kind("one", 1, int)
    """
    if not isinstance(value, kind):
        made = f", as {source} returns" if source else ""
        raise ParameterError(f"{name} must be a {kind.__name__}{made}. Got {told(value)} instead.")


def given(name: str, value: _Kind | None, kind: type[_Kind]) -> _Kind:
    """Return parameters of a kind, its defaults for None."""
    value = kind() if value is None else value
    check_kind(name, value, kind)
    return value


def check_number(name: str, value: object) -> float:
    """Return a finite number as a float."""
    if isinstance(value, bool | str) or type(value).__name__ == "bool":  # numpy's bool, too
        raise ParameterError(f"{name} must be a number. Got {told(value)} instead.")
    try:
        number = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        raise ParameterError(f"{name} must be a number. Got {told(value)} instead.") from None
    if not math.isfinite(number):
        raise ParameterError(f"{name} must be finite. Got {told(value)} instead.")
    return number


def check_depth(name: str, value: object) -> float | str:
    """Return a length greater than 0 as a float, or a share such as '25%' without spaces."""
    if not isinstance(value, str):
        return check_positive(name, value)
    try:
        share = float(value.strip().removesuffix("%")) if value.strip().endswith("%") else math.nan
    except ValueError:
        share = math.nan
    if not 0.0 < share <= 100.0:
        raise ParameterError(
            f"{name} must be a length, or a share of the scene's depth up to 100%, as '25%'. "
            f"Got {told(value)} instead."
        )
    return f"{share!r}%".replace(".0%", "%")


def check_range(name: str, value: object, low: float, high: float = math.inf) -> float:
    """Return a number between two others as a float."""
    number = check_number(name, value)
    if not low <= number <= high:
        wanted = f"between {low:g} and {high:g}"
        if high > 1e6:  # nobody gets there by design
            wanted = f"at least {low:g}" if number < low else f"at most {int(high):,}"
        raise ParameterError(f"{name} must be {wanted}. Got {told(value)} instead.")
    return number


def check_positive(name: str, value: object) -> float:
    """Return a number greater than 0 as a float."""
    number = check_number(name, value)
    if number <= 0.0:
        raise ParameterError(f"{name} must be greater than 0. Got {told(value)} instead.")
    return number


def check_whole(name: str, value: object, low: int = 1, high: int | None = None) -> int:
    """Return a whole number, which may be a float such as 3.0, as an int.

    Examples
    --------
    >>> check_whole("jobs", 2.0)
    2
    """
    is_bool = isinstance(value, bool) or type(value).__name__ == "bool"  # numpy's, too
    try:
        number = int(value)  # type: ignore[call-overload]
    except (TypeError, ValueError, OverflowError):
        number = None
    wanted = f", at least {low}"
    if high is not None and high <= 1e6:  # nobody gets beyond by design
        wanted = f" between {low} and {high}"
    elif high is not None and number is not None and number > high:
        wanted = f", at most {high:,}"
    fits = number is not None and number == value and number >= low and (high is None or number <= high)
    if is_bool or not fits:
        raise ParameterError(f"{name} must be a whole number{wanted}. Got {told(value)} instead.")
    return int(number)


def check_triple(name: str, value: object) -> Triple:
    """Return three numbers as a tuple."""
    try:
        items: tuple[object, ...] = () if isinstance(value, str) else tuple(value)  # type: ignore[arg-type]
    except TypeError:
        items = ()
    if len(items) != 3:
        raise ParameterError(f"{name} must be three numbers. Got {told(value)} instead.")
    x, y, z = (check_number(name, item) for item in items)
    return (x, y, z)


def check_direction(name: str, value: object) -> Triple:
    """Turn 'x', '-y', ... or three numbers into a direction."""
    if isinstance(value, str):
        axis = _AXES.get(value.lower().lstrip("+-"))
        if axis is None or len(value) > 2:
            raise ParameterError(
                f"{name} must be x, -x, y, -y, z, -z or three numbers. Got {told(value)} instead."
            )
        sign = -1.0 if value.startswith("-") else 1.0
        return (sign * axis[0] + 0.0, sign * axis[1] + 0.0, sign * axis[2] + 0.0)
    x, y, z = check_triple(name, value)
    largest = max(abs(x), abs(y), abs(z))
    if largest == 0.0:
        raise ParameterError(f"{name} must not be the zero vector. Got {told(value)} instead.")
    # Only the direction counts; its squares must neither overflow nor vanish.
    return (x / largest + 0.0, y / largest + 0.0, z / largest + 0.0)


def check_beta(value: float | Sequence[float]) -> float | tuple[float, ...]:
    """Return one attenuation factor, or several as a tuple."""
    if isinstance(value, int | float | str):
        return check_range("beta", value, 0.0)
    try:
        items = tuple(value)
    except TypeError:  # one number of another kind
        return check_range("beta", value, 0.0)
    return tuple(check_range("beta", item, 0.0) for item in items)


def check_indices(name: str, values: object) -> tuple[int, ...]:
    """Return numbers of vertices as a tuple."""
    try:
        items: Sequence[Any] = () if isinstance(values, str) else tuple(values)  # type: ignore[arg-type]
        wrong: list[object] = [values] if isinstance(values, str) else []
    except TypeError:
        items, wrong = (), [values]
    wrong += [item for item in items if isinstance(item, bool) or not isinstance(item, Integral) or item < 0]
    if wrong:
        raise ParameterError(
            f"{name} must be numbers of vertices, each at least 0. Got {told(wrong[0])} instead."
        )
    return tuple(int(item) for item in items)


def check_weights(name: str, values: object) -> tuple[float, ...]:
    """Return positive numbers as a tuple."""
    try:
        items = tuple(float(item) for item in values)  # type: ignore[attr-defined]
    except (TypeError, ValueError, OverflowError):
        raise ParameterError(
            f"{name} must be one number for each vertex. Got {told(values)} instead."
        ) from None
    wrong = [item for item in items if not 0.0 < item < math.inf]
    if wrong:
        raise ParameterError(f"{name} must be finite and greater than 0. Got {told(wrong[0])} instead.")
    return items
