"""How a relief shows itself in a notebook."""

from __future__ import annotations

from io import BytesIO
from typing import TYPE_CHECKING, Any

import numpy as np
from PIL import Image

from o3d_relief.scene.convert import arrays_mesh
from o3d_relief.show.sheets import view_sheet

if TYPE_CHECKING:
    from o3d_relief.relief import Relief

__all__ = ["relief_png"]


def relief_png(relief: Relief, panel: tuple[int, int] = (340, 380)) -> bytes:
    """Draw the scene above its relief, from the front and from two sides.

    Parameters
    ----------
    relief : Relief
    panel : (width, height)
        Of each view at most, in pixels.

    Returns
    -------
    bytes
        A PNG file.
    """
    scene: Any = relief.stages["scene"]
    before = arrays_mesh(np.array(scene.vertices * scene.unit), np.array(scene.faces))
    content = BytesIO()
    Image.fromarray(view_sheet(before, relief.mesh, panel=panel)).save(content, format="PNG")
    return content.getvalue()
