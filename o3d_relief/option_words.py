"""The names of parameters in a sentence, as the command line spells them."""

from __future__ import annotations

import re
from collections.abc import Collection

__all__ = ["as_options"]

_FIRST = re.compile(r"(\w+)(?: and (\w+))?\b(?!\.[A-Za-z])")
_VALUE = re.compile(r"""\b(\w+)=(True|False|'[\w-]+'|"[\w-]+")""")
_LONG = re.compile(r"(?<![\w./\\\0-])(?<!'s )[a-z]+(?:_[a-z]+)+(?![\w./\\\0-])")
_KEPT = "\0"
"""Stands for a name that is kept: no sentence and no file's name has it."""


def as_options(sentence: str, names: Collection[str], kept: Collection[str] = ()) -> str:
    """Spell the parameters that a sentence names as options.

    Names of several words are found everywhere, those of one word, which may be plain English, where the
    sentence begins with them; not those that are somebody else's, as "the tile's width_mm".

    Parameters
    ----------
    sentence : str
    names : collection of str
        The parameters that have options of the same name.
    kept : collection of str
        Names of files and folders, which stay as they are.

    Returns
    -------
    str

    Examples
    --------
    >>> as_options("base_mm must be less than depth_mm, 4.", ["base_mm", "depth_mm"])
    '--base-mm must be less than --depth-mm, 4.'
    >>> as_options('in_order=False needs mode="attenuation".', ["in_order", "mode"])
    '--no-in-order needs --mode attenuation.'
    >>> as_options("/my base_mm scans/a.ply: base_mm is 0.", ["base_mm"], ["/my base_mm scans/a.ply"])
    '/my base_mm scans/a.ply: --base-mm is 0.'
    """
    found: list[str] = []

    def put_away(match: re.Match[str]) -> str:
        found.append(match[0])
        return _KEPT

    def option(name: str) -> str:
        if name not in names:
            return name
        return f"-{name}" if len(name) == 1 else f"--{name.replace('_', '-')}"

    def with_value(match: re.Match[str]) -> str:
        name, value = match[1], match[2].strip("'\"")
        if name not in names:
            return match[0]
        if value in ("True", "False"):
            return option(name) if value == "True" else f"--no-{option(name)[2:]}"
        return f"{option(name)} {value}"

    # Of names within each other the longest is taken.
    words = [re.escape(name) for name in sorted(kept, key=len, reverse=True) if name]
    result = re.sub(rf"(?<!\w)(?:{'|'.join(words)})(?!\w)", put_away, sentence) if words else sentence
    result = _VALUE.sub(with_value, result)
    first = _FIRST.match(result)
    if first is not None and first[1] in names:
        result = " and ".join(option(word) for word in first.groups() if word) + result[first.end() :]
    result = _LONG.sub(lambda match: option(match[0]), result)
    names_of_files = iter(found)
    return re.sub(_KEPT, lambda _: next(names_of_files), result)
