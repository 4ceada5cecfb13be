"""The stage viewer's own process: records come in on the standard input, lines go to the standard error."""

from __future__ import annotations

import os
import pickle
import queue
import signal
import sys
import threading
import time
from typing import Any, BinaryIO

from o3d_relief.console import tell
from o3d_relief.errors import DisplayError
from o3d_relief.show.messages import Done, Opening

__all__ = ["main"]

_PAUSE = 0.01  # seconds between two looks at the keys


def main() -> int:
    """Show what comes in until the window is closed, or until the sender is gone before it was done.

    Returns
    -------
    int
        0, or 2 where the window cannot be opened.
    """
    # Ctrl-C is meant for the sender; the window follows when it ends.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    messages: queue.SimpleQueue[Any] = queue.SimpleQueue()
    # At once, so that the sender never waits for Open3D to be imported.
    threading.Thread(target=_receive, args=(sys.stdin.buffer, messages), daemon=True).start()
    from o3d_relief.show.viewer_window import ViewerWindow

    opening = messages.get()
    if not isinstance(opening, Opening):
        return 0
    try:
        window = ViewerWindow(
            tell, viewpoint=opening.viewpoint, colors=opening.colors, title=opening.title, size=opening.size
        )
    except DisplayError as error:
        tell(f"o3d-relief: error: {error}")
        return 2
    window.press("H")
    complete = False
    while window.step():
        message = _next(messages)
        if message is None:
            time.sleep(_PAUSE)
        elif isinstance(message, Done):
            complete = True
        elif isinstance(message, EOFError):
            if not complete:
                break
        else:
            window.take(message)
    window.close()
    return 0


def _receive(stream: BinaryIO, messages: queue.SimpleQueue[Any]) -> None:
    while True:
        try:
            messages.put(pickle.load(stream))
        except (EOFError, pickle.UnpicklingError) as end:  # cut off in the middle of a message, too
            messages.put(EOFError(str(end)))
            return


def _next(messages: queue.SimpleQueue[Any]) -> Any:
    try:
        return messages.get_nowait()
    except queue.Empty:
        return None


if __name__ == "__main__":
    code = main()
    if sys.stderr is not None:
        sys.stderr.flush()
    os._exit(code)  # an orderly end would wait for the thread that waits for the sender
