"""Fixtures that several test modules share."""

import os
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def data_folder() -> Path:
    """Return the folder of real meshes that O3D_RELIEF_DATA names."""
    name = os.environ.get("O3D_RELIEF_DATA")
    if not name:
        pytest.skip("O3D_RELIEF_DATA does not name a folder of meshes")
    folder = Path(name)
    if not folder.is_dir():
        pytest.skip(f"the folder of O3D_RELIEF_DATA, {name}, is missing")
    return folder
