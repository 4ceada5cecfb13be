"""Work in threads beside the one that asks for it.

What runs in them is numpy, sparse matrices and trees of scipy, and Clarabel, which let other threads run
meanwhile. None of it calls the linear algebra of `linalg.one_thread`, whose limits hold for all threads.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager
from typing import TypeVar

__all__ = ["each", "one_beside"]

_MOST = 4
"""Threads at most: each needs memory of its own."""

_Item = TypeVar("_Item")
_Result = TypeVar("_Result")


@contextmanager
def one_beside() -> Iterator[Executor]:
    """Provide one thread that does one thing after the other, in the order in which they are asked for.

    At the end of the block, however it ends, what has not begun is dropped, and the thread is gone.

    Examples
    --------
    >>> with one_beside() as thread:
    ...     thread.submit(sum, [1, 2, 3]).result()
    6
    """
    thread = ThreadPoolExecutor(max_workers=1, thread_name_prefix="o3d-relief")
    try:
        yield thread
    finally:
        thread.shutdown(cancel_futures=True)


def each(function: Callable[[_Item], _Result], items: Sequence[_Item]) -> list[_Result]:
    """Call a function with each of some items, several at a time.

    Parameters
    ----------
    function : callable
        Its results must not depend on other calls of it.
    items : sequence

    Returns
    -------
    list
        The results, in the order of the items.

    Examples
    --------
    >>> each(abs, [-1, 2, -3])
    [1, 2, 3]
    """
    threads = min(len(items), os.cpu_count() or 1, _MOST)
    if threads < 2:
        return [function(item) for item in items]
    with ThreadPoolExecutor(threads, thread_name_prefix="o3d-relief") as pool:
        return list(pool.map(function, items))
