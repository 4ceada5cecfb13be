"""Fixtures that several test modules share."""

import os
from collections.abc import Iterator
from hashlib import sha256
from pathlib import Path

import pytest

from o3d_relief.batch_entry import BatchEntry
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


@pytest.fixture
def made_entry(tmp_path: Path) -> BatchEntry:
    """Return an entry of a batch whose input, relief and picture exist."""
    scan = tmp_path / "scan.ply"
    scan.write_bytes(b"points")
    (tmp_path / "pictures").mkdir()
    (tmp_path / "pictures" / "relief.png").touch()
    (tmp_path / "relief.obj").write_bytes(b"faces")
    return BatchEntry(
        input=str(scan), output="relief.obj", status="made", seconds=1.5, depth=1 / 3, triangles=7,
        notes=("no textures", "Größe"), attempts=2, input_bytes=6, input_mtime_ns=scan.stat().st_mtime_ns,
        recipe="abc", output_sha256=sha256(b"faces").hexdigest(),
        certificate={"visible_behind": 2, "places": [{"where": [0.1, 1 / 3]}], "failures": ["2 lie behind."]},
    )  # fmt: skip
