"""Fixtures that several test modules share."""

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from screen import Screen, missing


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


@pytest.fixture(scope="session")
def screen(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Screen]:
    """Start a screen for real windows."""
    if missing():
        pytest.skip(f"there is no screen: install Debian's packages {' '.join(missing())}")
    screen = Screen(tmp_path_factory.mktemp("screen"))
    yield screen
    screen.close()
