"""Memory that arrays leave behind is used again for the next ones."""

from __future__ import annotations

import ctypes
import os
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

__all__ = ["give_back", "memory_kept"]

_TRIM_THRESHOLD, _MMAP_THRESHOLD, _MMAP_MAX = -1, -3, -4
"""Names of settings in glibc's malloc.h."""

_KEEPING = ((_MMAP_MAX, 0), (_TRIM_THRESHOLD, -1))
_USUAL = ((_MMAP_MAX, 65536), (_MMAP_THRESHOLD, 32 << 20), (_TRIM_THRESHOLD, 64 << 20))
"""What glibc comes to by itself once a large array has been freed."""

_OWN_CHOICE = ("GLIBC_TUNABLES", "MALLOC_MMAP_MAX_", "MALLOC_MMAP_THRESHOLD_", "MALLOC_TRIM_THRESHOLD_")


class _Blocks:
    """The blocks that are entered, in all threads."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self.entered = 0

    def enter(self, mallopt: Callable[[int, int], int]) -> None:
        with self._lock:
            self.entered += 1
            if self.entered == 1:
                for setting in _KEEPING:
                    mallopt(*setting)

    def leave(self, mallopt: Callable[[int, int], int], malloc_trim: Callable[[int], int]) -> None:
        with self._lock:
            self.entered -= 1
            if self.entered == 0:
                for setting in _USUAL:
                    mallopt(*setting)
                malloc_trim(0)


_blocks = _Blocks()


@contextmanager
def memory_kept() -> Iterator[None]:
    """Keep what is freed within the block for whatever is asked for next.

    glibc gives an array of more than 32 MB back to the system as soon as it is freed, and the next one gets
    fresh pages, which the kernel has to clear: a third of the time at ten million vertices. It concerns what
    the main thread allocates; the others have memory of their own. Where blocks overlap, in threads, the last
    one that ends returns to the usual and gives everything back. Nothing happens on other systems, and where
    the environment holds settings of malloc.
    """
    calls = _calls()
    if calls is None:
        yield
        return
    mallopt, malloc_trim = calls
    _blocks.enter(mallopt)
    try:
        yield
    finally:
        _blocks.leave(mallopt, malloc_trim)


def give_back() -> None:
    """Give back what is free within a block of `memory_kept`, in all threads.

    What a thread beside the main one has freed, nobody else can use.
    """
    calls = _calls()
    if calls is not None:
        calls[1](0)


def _calls() -> tuple[Callable[[int, int], int], Callable[[int], int]] | None:
    """Return the functions mallopt and malloc_trim of glibc, None where they are not to be called."""
    if sys.platform != "linux" or any(name in os.environ for name in _OWN_CHOICE):
        return None
    library = ctypes.CDLL(None)
    if not hasattr(library, "gnu_get_libc_version"):
        return None
    return library.mallopt, library.malloc_trim
