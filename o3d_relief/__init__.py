"""High reliefs from 3D scenes: an Open3D geometry plugin."""

from __future__ import annotations

import os
import sys
from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from o3d_relief.batch import Batch, make_reliefs
    from o3d_relief.batch_entry import BatchEntry
    from o3d_relief.editor import ReliefEditor
    from o3d_relief.errors import (
        Cancelled,
        DisplayError,
        FileError,
        MeshError,
        ParameterError,
        ReliefError,
        SolverError,
    )
    from o3d_relief.linalg.laplacian import cotangent_laplacian
    from o3d_relief.measure import ReliefQuality, Yardstick, measure_relief
    from o3d_relief.params import ReliefParams, View
    from o3d_relief.params_file import load_params, save_params
    from o3d_relief.pipeline import make_relief
    from o3d_relief.plate_params import PlateParams
    from o3d_relief.point_edits import PointEdit
    from o3d_relief.relief import Relief
    from o3d_relief.scan_params import ScanParams
    from o3d_relief.scene.demo import demo_scene
    from o3d_relief.scene.read import read_mesh, read_points
    from o3d_relief.scene.scan import Scan, mesh_from_points, scan_points
    from o3d_relief.scene.write import write_mesh
    from o3d_relief.show.camera import view_direction
    from o3d_relief.show.comparison import comparison_sheet
    from o3d_relief.show.edit import edit
    from o3d_relief.show.render import render, save_png
    from o3d_relief.show.sheets import contact_sheet
    from o3d_relief.show.viewer import StageViewer, show_stages
    from o3d_relief.solid.block import solid_under
    from o3d_relief.solid.body import Solid
    from o3d_relief.solid.checks import SolidReport, check_solid
    from o3d_relief.solid.formats import write_solid
    from o3d_relief.solid.heightmap import write_height_map
    from o3d_relief.solid.heights import height_field
    from o3d_relief.solid.make import make_solid
    from o3d_relief.solid.milling import milled
    from o3d_relief.solid.tiles import make_tiles
    from o3d_relief.workshop_params import MillParams, TileParams

if "ipykernel" in sys.modules:
    # In a notebook Open3D opens connections to public servers as soon as it is imported; "false" allows it.
    os.environ.setdefault("OPEN3D_DISABLE_WEB_VISUALIZER", "true")

__version__ = "0.1.0"

__all__ = [
    "Batch",
    "BatchEntry",
    "Cancelled",
    "DisplayError",
    "FileError",
    "MeshError",
    "MillParams",
    "ParameterError",
    "PlateParams",
    "PointEdit",
    "Relief",
    "ReliefEditor",
    "ReliefError",
    "ReliefParams",
    "ReliefQuality",
    "Scan",
    "ScanParams",
    "Solid",
    "SolidReport",
    "SolverError",
    "StageViewer",
    "TileParams",
    "View",
    "Yardstick",
    "check_solid",
    "comparison_sheet",
    "contact_sheet",
    "cotangent_laplacian",
    "demo_scene",
    "edit",
    "height_field",
    "load_params",
    "make_relief",
    "make_reliefs",
    "make_solid",
    "make_tiles",
    "measure_relief",
    "mesh_from_points",
    "milled",
    "read_mesh",
    "read_points",
    "render",
    "save_params",
    "save_png",
    "scan_points",
    "show_stages",
    "solid_under",
    "view_direction",
    "write_height_map",
    "write_mesh",
    "write_solid",
]

_HOME = {
    "Batch": "batch",
    "BatchEntry": "batch_entry",
    "make_reliefs": "batch",
    "Cancelled": "errors",
    "DisplayError": "errors",
    "FileError": "errors",
    "MeshError": "errors",
    "ParameterError": "errors",
    "ReliefError": "errors",
    "SolverError": "errors",
    "ReliefParams": "params",
    "View": "params",
    "ReliefEditor": "editor",
    "PointEdit": "point_edits",
    "load_params": "params_file",
    "save_params": "params_file",
    "Relief": "relief",
    "PlateParams": "plate_params",
    "Solid": "solid.body",
    "SolidReport": "solid.checks",
    "check_solid": "solid.checks",
    "make_solid": "solid.make",
    "make_tiles": "solid.tiles",
    "height_field": "solid.heights",
    "solid_under": "solid.block",
    "milled": "solid.milling",
    "write_height_map": "solid.heightmap",
    "write_solid": "solid.formats",
    "MillParams": "workshop_params",
    "TileParams": "workshop_params",
    "make_relief": "pipeline",
    "cotangent_laplacian": "linalg.laplacian",
    "ReliefQuality": "measure",
    "Yardstick": "measure",
    "measure_relief": "measure",
    "demo_scene": "scene.demo",
    "ScanParams": "scan_params",
    "Scan": "scene.scan",
    "mesh_from_points": "scene.scan",
    "scan_points": "scene.scan",
    "read_mesh": "scene.read",
    "read_points": "scene.read",
    "write_mesh": "scene.write",
    "comparison_sheet": "show.comparison",
    "contact_sheet": "show.sheets",
    "render": "show.render",
    "save_png": "show.render",
    "view_direction": "show.camera",
    "StageViewer": "show.viewer",
    "edit": "show.edit",
    "show_stages": "show.viewer",
}


def __getattr__(name: str) -> object:
    # Open3D takes seconds to import: a name is loaded when it is first used, so that `--help` is instant.
    if name not in _HOME:
        raise AttributeError(f"module 'o3d_relief' has no attribute {name!r}")
    value = getattr(import_module(f"o3d_relief.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
