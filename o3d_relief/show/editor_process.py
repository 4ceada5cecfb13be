"""The live editor's own process: a scene comes in on the standard input, a parameter file is left behind.

Open3D's gui draws through drivers that may abort the process, and does not always end in good order.
"""

from __future__ import annotations

import os
import pickle
import signal
import sys
import threading
from typing import Any

from o3d_relief.console import tell
from o3d_relief.params_file import save_params
from o3d_relief.show.messages import EditorOpening

__all__ = ["main"]


def main() -> int:
    """Open the window, wait until it is closed and write its parameters to a file.

    Returns
    -------
    int
        0, or 2 where no relief can be made; the standard error says why.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is meant for the sender
    opening = pickle.load(sys.stdin.buffer)
    if not isinstance(opening, EditorOpening):
        raise TypeError(f"expected an EditorOpening, got {opening!r}")

    import open3d as o3d

    from o3d_relief.scene.arrays import to_open3d
    from o3d_relief.show.editor_window import EditorWindow

    o3d.utility.set_verbosity_level(o3d.utility.VerbosityLevel.Error)
    window = EditorWindow(
        to_open3d(opening.scene),
        opening.params,
        opening.view,
        output=opening.output,
        size_mm=opening.size_mm,
        title=opening.title,
        size=opening.size,
    )
    threading.Thread(target=_follow, args=(window,), daemon=True).start()
    end = window.run()
    if end is None:
        tell(f"o3d-relief: error: {window.studio.work.sentence}")
        return 2
    save_params(opening.result, *end)
    return 0


def _follow(window: Any) -> None:
    """Close the window when the sender is gone."""
    sys.stdin.buffer.read()
    window.quit()


if __name__ == "__main__":
    code = main()
    sys.stderr.flush()
    os._exit(code)  # an orderly end crashes in Open3D, which outlives its own renderer
