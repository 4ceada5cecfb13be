"""The command o3d-relief view."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from o3d_relief.console import tell, tell_stage, tell_unused
from o3d_relief.errors import Cancelled, MeshError
from o3d_relief.files import check_exists
from o3d_relief.make_command import read_scene
from o3d_relief.relief_arguments import chosen_params, chosen_view
from o3d_relief.scan_arguments import chosen_scan
from o3d_relief.show.display import require_display

if TYPE_CHECKING:
    from o3d_relief.records import StageRecord

__all__ = ["view"]


def view(options: argparse.Namespace) -> int:
    """Run the command "view".

    Parameters
    ----------
    options : argparse.Namespace

    Returns
    -------
    int
        Exit code 0, also where the window is closed while the relief is still being made.

    Raises
    ------
    ReliefError
        Anything that the user can mend.
    """
    params, eye, scan = chosen_params(options), chosen_view(options), chosen_scan(options)
    check_exists(options.input)
    tell_unused(params)
    require_display()

    from o3d_relief.pipeline import make_relief
    from o3d_relief.progress_bar import StageBar
    from o3d_relief.scene.scan import scan_points
    from o3d_relief.show.viewer import StageViewer

    scene, meshing = read_scene(options.input, scan)
    bar = StageBar()
    try:
        if meshing is not None:  # the window shows the mesh in the colours of the points
            scene = scan_points(scene, meshing, view=eye, on_stage=tell_stage, on_progress=bar).mesh
        with StageViewer(scene, eye, title=f"o3d-relief: {options.input.name}") as viewer:

            def show(record: StageRecord) -> None:
                tell_stage(record)
                viewer(record)

            def watch(stage: str, share: float | None) -> bool:
                bar(stage, share)
                return not viewer.closed

            relief = make_relief(
                scene,
                params,
                view=eye,
                on_stage=show,
                on_progress=watch,
                max_triangles=options.max_triangles,
            )
            viewer.finish(relief)
            viewer.wait()
    except Cancelled:
        tell("the window was closed before the relief was finished")
    except MeshError as error:
        raise MeshError(f"{options.input}: {error}") from error
    finally:
        bar.close()
    return 0
