"""Records that nobody can change, and that can be pickled and copied all the same."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from types import MappingProxyType
from typing import Any

import numpy as np

__all__ = ["Frozen"]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Frozen:
    """Base of frozen dataclasses: their arrays become read-only views, their mappings read-only copies.

    Pickling goes by the fields, so that a pickle is for one version of this package.

    Examples
    --------
    >>> @dataclass(frozen=True, kw_only=True, eq=False)
    ... class Weights(Frozen):
    ...     values: np.ndarray
    >>> Weights(values=np.ones(3)).values.flags.writeable
    False
    """

    def __post_init__(self) -> None:
        for name, value in self._values().items():
            if isinstance(value, np.ndarray):
                frozen: Any = value.view()  # the caller's own array stays as it is
                frozen.flags.writeable = False
            elif isinstance(value, Mapping):
                frozen = MappingProxyType(dict(value))
            else:
                continue
            object.__setattr__(self, name, frozen)

    def _values(self) -> dict[str, Any]:
        return {item.name: getattr(self, item.name) for item in fields(self)}

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        values = self._values()
        proxies = {name: dict(value) for name, value in values.items() if isinstance(value, MappingProxyType)}
        return _made_again, (type(self), values | proxies)


def _made_again(kind: type, values: dict[str, Any]) -> object:
    return kind(**values)
