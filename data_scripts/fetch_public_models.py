"""Fetch well-known public models through Open3D, to make reliefs of them. Needs a network.

python data_scripts/fetch_public_models.py --list
python data_scripts/fetch_public_models.py models/ Armadillo Bunny
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path

TERMS = "https://www.open3d.org/docs/release/tutorial/data/index.html"


@dataclass(frozen=True)
class Model:
    """A data set of `open3d.data`: the name of its class, what it is, and where it comes from."""

    dataset: str
    what: str
    source: str


STANFORD = "Stanford 3D Scanning Repository; see graphics.stanford.edu/data/3Dscanrep for its terms"
MODELS = {
    "Armadillo": Model("ArmadilloMesh", "mesh, 173k vertices", STANFORD),
    "Bunny": Model("BunnyMesh", "mesh, 36k vertices", STANFORD),
    "Knot": Model("KnotMesh", "mesh, a plain knot", "see Open3D's page"),
    "Monkey": Model("MonkeyModel", "textured mesh", "the Blender monkey"),
    "Avocado": Model("AvocadoModel", "textured mesh (GLB)", "Khronos glTF sample, CC0"),
    "DamagedHelmet": Model(
        "DamagedHelmetModel",
        "textured mesh (GLB)",
        "Khronos glTF sample, not for commercial use (CC BY-NC 4.0)",
    ),
    "FlightHelmet": Model(
        "FlightHelmetModel", "textured mesh of several parts (glTF)", "Khronos glTF sample, CC0"
    ),
    "Sword": Model("SwordModel", "textured mesh", "see Open3D's page"),
    "Crate": Model("CrateModel", "textured mesh", "see Open3D's page"),
    "Eagle": Model("EaglePointCloud", "coloured point cloud with normals", "see Open3D's page"),
}


def fetch(name: str, folder: Path) -> Path:
    """Download one model below the folder, unless it is there, and return its file."""
    import open3d as o3d

    folder.mkdir(parents=True, exist_ok=True)
    with o3d.utility.VerbosityContextManager(o3d.utility.VerbosityLevel.Error):
        path = Path(getattr(o3d.data, MODELS[name].dataset)(data_root=str(folder)).path)
    if not path.is_file():
        raise FileNotFoundError(path)
    return path


def main() -> int:
    """Fetch what the command line names; return the exit code."""
    parser = argparse.ArgumentParser(
        description="Fetch well-known public models through open3d.data into a folder. Needs a network.",
        epilog=f"Each model has its own terms of use: {TERMS}",
    )
    parser.add_argument("folder", nargs="?", type=Path, help="where the models go; made if it is missing")
    parser.add_argument("names", nargs="*", metavar="MODEL", help="which models (default: all); see --list")
    parser.add_argument("--list", action="store_true", help="list the models and stop")
    options = parser.parse_args()
    if options.list:
        for name, model in MODELS.items():
            print(f"{name:14} {model.what}; {model.source}")
        print(f"Terms: {TERMS}")
        return 0
    if options.folder is None:
        parser.error("name the folder that the models go to, or give --list")
    unknown = [name for name in options.names if name not in MODELS]
    if unknown:
        parser.error(f"there is no model {unknown[0]!r}; --list names them all")
    for name in options.names or MODELS:
        try:
            path = fetch(name, options.folder)
        except OSError as error:
            print(f"{name} could not be stored in {options.folder}: {error}.", file=sys.stderr)
            return 2
        except RuntimeError:  # Open3D's own text is several lines of C++ signatures
            print(
                f"{name} could not be downloaded: is there a network, and room in {options.folder}?",
                file=sys.stderr,
            )
            return 2
        print(f"{name}: {path} ({MODELS[name].source})")
    print(f"Each model has its own terms of use: {TERMS}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
