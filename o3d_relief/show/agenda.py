"""What the live editor is asked for: requests that wait for their turn, and when one under way is void."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

from o3d_relief.editor import ReliefEditor

__all__ = ["Act", "Agenda", "Request"]

Act = Callable[[ReliefEditor, bool], object]
"""Changes the editor; the second argument says whether the same change goes on, as of a slider."""

_FINISH = "finish"


@dataclass(frozen=True, kw_only=True)
class Request:
    """A change that was asked for.

    Attributes
    ----------
    name : str
        Of the slider or button.
    act : callable
    doing : str
        What is told while it lasts.
    due : float
        Seconds on the monotonic clock before which it waits.
    changes : bool
        Whether the relief is another one afterwards.
    """

    name: str
    act: Act
    doing: str
    due: float
    changes: bool


class Agenda:
    """The requests that wait, in order; one thread puts them in, another takes them out.

    Parameters
    ----------
    finish : callable
        What finishes the relief: it comes by itself after a change, once nothing has been asked for a while.
    rest : float
        Seconds without a request after which it comes.
    finishing : bool
        Whether it comes at all.

    Attributes
    ----------
    unfinished : bool
        Whether the relief is to be finished; to be set by who takes the requests.
    """

    def __init__(self, finish: Act, *, rest: float, finishing: bool) -> None:
        self.unfinished = False
        self._finish, self._rest, self._finishing = finish, rest, finishing
        self._change = threading.Condition()
        self._requests: list[Request] = []
        self._now: Request | None = None
        self._called_off = self._closed = False

    # What is asked for.

    def ask(self, request: Request) -> None:
        """Put a request in; one of the same name that still waits is dropped for it."""
        with self._change:
            self._requests = [other for other in self._requests if other.name != request.name] + [request]
            self._change.notify_all()

    def finish(self, *, wanted: bool) -> None:
        """Say whether the relief is to be finished; where not, what finishes it now is called off."""
        with self._change:
            self._finishing = wanted
            if self._now is not None and self._now.name == _FINISH:
                self._called_off = not wanted
            self._change.notify_all()

    def cancel(self) -> None:
        """Call off what is being done."""
        with self._change:
            self._called_off = True

    def close(self) -> None:
        """Call off everything, for good."""
        with self._change:
            self._closed = self._called_off = True
            self._change.notify_all()

    @property
    def closed(self) -> bool:
        """Whether nothing more is to be done."""
        return self._closed

    @property
    def called_off(self) -> bool:
        """Whether what is being done was called off."""
        return self._called_off

    @property
    def waiting(self) -> bool:
        """Whether a request has not been carried out yet."""
        with self._change:
            return bool(self._requests)

    # What is done.

    def next(self) -> Request | None:
        """Wait for a request; finish the relief where none has come for a while. None: the end."""
        with self._change:
            rested = time.monotonic() + self._rest
            while not self._closed:
                now = time.monotonic()
                due = [request for request in self._requests if request.due <= now]
                if due:
                    self._requests.remove(due[0])
                    return self._taken(due[0])
                if self._requests:
                    self._change.wait(min(request.due for request in self._requests) - now)
                elif self._finishing and self.unfinished and now < rested:
                    self._change.wait(rested - now)
                elif self._finishing and self.unfinished:
                    self.unfinished = False
                    finish = Request(name=_FINISH, act=self._finish, doing="", due=now, changes=False)
                    return self._taken(finish)
                else:
                    self._change.wait()
        return None

    def _taken(self, request: Request) -> Request:
        self._now, self._called_off = request, False
        return request

    def done(self) -> None:
        """Say that the request that was taken last is carried out."""
        with self._change:
            self._now = None

    def change_is_void(self) -> bool:
        """Tell whether the change under way was called off, or a newer one of its name waits."""
        with self._change:
            now = self._now
            newer = now is not None and any(request.name == now.name for request in self._requests)
            return newer or self._called_off

    def relief_is_void(self) -> bool:
        """Tell whether the relief under way was called off, or a change waits while it is only finished.

        One that is to be saved gives way to nobody. Where it is void, it is left to be finished after the
        changes that wait; `unfinished` then says so.
        """
        now = time.monotonic()
        with self._change:
            finishing = self._now is not None and self._now.name == _FINISH
            waiting = any(request.due <= now and request.changes for request in self._requests)
            void = (waiting and finishing) or self._called_off
            if void:
                self.unfinished = waiting
            return void
