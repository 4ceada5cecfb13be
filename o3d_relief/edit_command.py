"""The command o3d-relief edit."""

from __future__ import annotations

import argparse

from o3d_relief.console import tell, tell_stage
from o3d_relief.errors import MeshError
from o3d_relief.files import check_exists
from o3d_relief.make_command import read_scene
from o3d_relief.params import ReliefParams, View
from o3d_relief.relief_arguments import chosen_params, chosen_view
from o3d_relief.scan_arguments import chosen_scan
from o3d_relief.show.display import require_display, require_vulkan

__all__ = ["edit"]


def edit(options: argparse.Namespace) -> int:
    """Run the command "edit".

    Parameters
    ----------
    options : argparse.Namespace

    Returns
    -------
    int
        Exit code 0.

    Raises
    ------
    ReliefError
        Anything that the user can mend.
    """
    params, eye, scan = chosen_params(options), chosen_view(options), chosen_scan(options)
    check_exists(options.input)
    require_display()
    require_vulkan()

    from o3d_relief.scene.scan import scan_points
    from o3d_relief.show import edit as window

    scene, meshing = read_scene(options.input, scan)
    try:
        if meshing is not None:
            scene = scan_points(scene, meshing, view=eye, on_stage=tell_stage).mesh
        params, eye = window.edit(
            scene,
            params,
            eye,
            output=options.output,
            size_mm=options.size_mm,
            title=f"o3d-relief edit: {options.input.name}",
        )
    except MeshError as error:
        raise MeshError(f"{options.input}: {error}") from error
    tell(f"closed with {_words(params, eye)}")
    return 0


def _words(params: ReliefParams, eye: View) -> str:
    """Name what counts in the mode that was chosen last."""
    depth = params.depth if params.depth is None or isinstance(params.depth, str) else f"{params.depth:g}"
    if params.depth is not None and params.bounded:
        words = f"the closest relief of depth {depth}"
    else:
        edits = len(params.point_edits)
        points = "1 point" if edits == 1 else f"{edits} points"
        squeezed = f"alpha {params.alpha}" if params.depth is None else f"depth {depth}"
        words = f"k {params.k}, beta {params.beta}, {squeezed}, {points} edited by hand"
    return words if eye.vanishing_point is None else f"{words}, vanishing point {eye.vanishing_point}"
