"""Parameters, view and edits as a small file."""

from __future__ import annotations

import json
import reprlib
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any, TypeVar

from o3d_relief import __version__
from o3d_relief.errors import FileError, ParameterError
from o3d_relief.files import check_exists, write_bytes
from o3d_relief.param_checks import given
from o3d_relief.params import ReliefParams, View
from o3d_relief.point_edits import PointEdit

__all__ = ["field_values", "load_params", "save_params"]

_WANTED = 'wanted is an object with "params" and "view", as the editor and save_params write it'

_Kind = TypeVar("_Kind", ReliefParams, View, PointEdit)


def save_params(path: str | Path, params: ReliefParams, view: View | None = None) -> None:
    """Write parameters and view to a JSON file that replays them exactly.

    Every parameter is written, also where it is at its default, and numbers with all their digits. The
    edits of single points and the weights are among the parameters.

    Parameters
    ----------
    path : str or Path
    params : ReliefParams
    view : View, optional
        The default view where omitted.

    Raises
    ------
    FileError
        The file cannot be written.
    ParameterError
        `params` is no ReliefParams, or `view` no View.
    """
    values = {
        "o3d_relief": __version__,
        "params": asdict(given("params", params, ReliefParams)),
        "view": asdict(given("view", view, View)),
    }
    write_bytes(path, (json.dumps(values, indent=1) + "\n").encode())


def load_params(path: str | Path) -> tuple[ReliefParams, View]:
    """Read parameters and view from a JSON file.

    Parameters
    ----------
    path : str or Path
        An object with the keys "params" and "view"; both, and each value in them, may be left out and are
        then at their defaults. A key "o3d_relief" names the version that wrote the file.

    Returns
    -------
    params : ReliefParams
    view : View

    Raises
    ------
    FileError
        No such file, not a JSON file, or the report of a relief.
    ParameterError
        A key that is not known, or a value out of its range.
    """
    check_exists(path)
    try:
        text = Path(path).read_bytes().decode("utf-8-sig")
        values = json.loads(text, object_pairs_hook=_each_once)
    except OSError as error:
        raise FileError(f"{path} cannot be read: {error.strerror}.") from error
    except (ValueError, RecursionError) as error:
        why = "it is no text" if isinstance(error, UnicodeDecodeError) else error
        raise FileError(f"{path} is not a parameter file in JSON: {why}; {_WANTED}.") from error
    if isinstance(values, dict) and {"params", "view", "stages"} <= values.keys():
        raise FileError(
            f'{path} is the report of a relief, not a parameter file: keep only its "params" and "view", '
            "in a copy of it."
        )
    try:
        _check_keys("the file", values, ("o3d_relief", "params", "view"))
        given = _object("params", values.get("params", {}), ReliefParams)
        edits = given.get("point_edits", [])
        if not isinstance(edits, list):
            raise ParameterError(f"point_edits must be a list. Got {edits!r} instead.")
        given["point_edits"] = [PointEdit(**_object("an edit", edit, PointEdit)) for edit in edits]
        return ReliefParams(**given), View(**_object("view", values.get("view", {}), View))
    except ParameterError as error:
        raise ParameterError(f"{path}: {error}") from error


def field_values(value: ReliefParams | View | PointEdit) -> dict[str, Any]:
    """Return the fields of parameters by name.

    Parameters
    ----------
    value : ReliefParams, View or PointEdit

    Returns
    -------
    dict
        The values themselves, edits as `PointEdit`.
    """
    return {item.name: getattr(value, item.name) for item in fields(value)}


def _object(name: str, values: object, kind: type[_Kind]) -> dict[str, Any]:
    """Check that values are a JSON object for the fields of a class."""
    required = ["vertex"] if kind is PointEdit else []
    known = [item.name for item in fields(kind)]
    checked = _check_keys(name, values, known)
    for key in required:
        if key not in checked:
            raise ParameterError(f'{name} has no "{key}".')
    return dict(checked)


def _check_keys(name: str, values: object, known: list[str] | tuple[str, ...]) -> dict[str, Any]:
    wanted = f"; {_WANTED}" if name == "the file" else ""
    if not isinstance(values, dict):
        short = reprlib.repr(values)
        raise ParameterError(f"{name} must be an object with names and values. Got {short} instead{wanted}.")
    for key in values:
        if key not in known:
            raise ParameterError(f"{key!r} is not known in {name}: choose among {', '.join(known)}{wanted}.")
    return values


def _each_once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    values = dict(pairs)
    if len(values) < len(pairs):
        names = [name for name, _ in pairs]
        twice = next(name for name in names if names.count(name) > 1)
        raise ValueError(f"{twice!r} is given twice")
    return values
