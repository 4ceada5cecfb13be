"""Sums on one thread, so that they do not depend on the number of threads."""

from __future__ import annotations

from contextlib import AbstractContextManager
from functools import cache
from typing import Any, cast

import scipy.linalg  # noqa: F401  loads its libraries
from threadpoolctl import ThreadpoolController

__all__ = ["one_thread"]


def one_thread() -> AbstractContextManager[Any]:
    """Return a context in which the linear algebra of numpy and scipy uses one thread.

    Examples
    --------
    >>> import numpy as np
    >>> with one_thread():
    ...     float(np.ones(3) @ np.ones(3))
    3.0
    """
    return cast(AbstractContextManager[Any], _libraries().limit(limits=1))


@cache
def _libraries() -> ThreadpoolController:
    """Find the libraries once, which takes milliseconds; numpy and scipy load theirs when imported."""
    return ThreadpoolController()
