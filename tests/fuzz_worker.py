"""One case of the fuzz tests, run in a process of its own that may die of it."""

from __future__ import annotations

import json
import multiprocessing
import os
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from functools import partial
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import psutil

SECONDS = 60.0
"""A case that computes longer hangs; none should take a second."""

_WAIT = 20.0
"""So many times longer a case may last on a busy machine, or asleep."""

_MEMORY = 6 * 2**30
_GRID = 64


@dataclass(frozen=True)
class Case:
    """A file or the arrays of a mesh or a point cloud, and what is asked for."""

    name: str
    files: dict[str, bytes] = field(default_factory=dict)
    arrays: dict[str, Any] = field(default_factory=dict)
    params: dict[str, Any] = field(default_factory=dict)
    view: dict[str, Any] = field(default_factory=dict)
    scan: dict[str, Any] = field(default_factory=dict)
    output: str = ".ply"
    picture: bool = False


class Pool:
    """A worker that is replaced when it dies."""

    def __init__(self) -> None:
        self._process: Any = None
        self._pipe: Any = None

    def run(self, case: Case) -> str:
        """Return what became of a case: "relief", "refused: ..." or "BUG: ..."."""
        if self._process is None or not self._process.is_alive():
            self._start()
        before, started = self._computed(), time.monotonic()
        self._pipe.send(case)
        try:
            while not self._pipe.poll(0.2):
                # Measured on the worker: a busy machine takes nothing away from it.
                waited = (time.monotonic() - started) / _WAIT
                if max(waited, self._computed() - before) > SECONDS:
                    self.close()
                    return f"BUG: it takes more than {SECONDS:g} s"
            return self._pipe.recv()
        except (EOFError, ConnectionError):
            self._process.join()
            code = self._process.exitcode
            self.close()
            return f"BUG: the process died with exit code {code}"

    def _computed(self) -> float:
        """Return the seconds of computing that the worker has used, 0 where it has died."""
        with suppress(psutil.Error):
            times = psutil.Process(self._process.pid).cpu_times()
            return float(times.user + times.system)
        return 0.0

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._pipe, far_end = context.Pipe()
        self._process = context.Process(target=_serve, args=(far_end,), daemon=True)
        self._process.start()
        far_end.close()

    def close(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.join()
            self._pipe.close()
        self._process = None


@contextmanager
def _no_limits(limits: int) -> Iterator[None]:
    yield


def _serve(pipe: Connection) -> None:
    """Run cases until the other end is closed."""
    os.environ |= {
        "OPEN3D_DISABLE_WEB_VISUALIZER": "true",
        "OMP_NUM_THREADS": "1",
        "OPENBLAS_NUM_THREADS": "1",
    }
    from o3d_relief import bounded_step
    from o3d_relief.bounds import certificate
    from o3d_relief.linalg import interior, solve
    from o3d_relief.stages import attenuation, clustering

    if sys.platform == "linux":
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (_MEMORY, _MEMORY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    # A million rays for a mesh of fifty vertices, and to look for the libraries that use threads before each
    # small system, would be nearly all of the time.
    for module in (bounded_step, certificate):
        module.grid_pairs = partial(module.grid_pairs, side=_GRID)
    bounded_step.seen_points = partial(bounded_step.seen_points, side=_GRID)
    for module in (solve, interior, clustering, attenuation):
        module.threadpool_limits = _no_limits
    warnings.simplefilter("error")
    with tempfile.TemporaryDirectory(prefix="o3d-relief-fuzz-") as folder:
        heard, work = Path(folder) / "heard", Path(folder) / "case"
        work.mkdir()
        stream = os.open(heard, os.O_RDWR | os.O_CREAT | os.O_APPEND)
        for number in (1, 2):
            os.dup2(stream, number)
        while True:
            try:
                case = pipe.recv()
            except EOFError:
                return
            os.truncate(heard, 0)
            outcome = _run(case, work)
            for path in work.iterdir():
                path.unlink()
            said = heard.read_bytes()
            if said and not outcome.startswith("BUG"):
                outcome = f"BUG: something was printed: {said[:300]!r}"
            pipe.send(outcome)


def _run(case: Case, folder: Path) -> str:
    from o3d_relief import ReliefError

    try:
        return _check(case, folder)
    except ReliefError as error:
        text = str(error)
        if "\n" in text or not text.endswith(".") or len(text) > 400:
            return f"BUG: {type(error).__name__} is not one clear sentence: {text!r}"
        return f"refused: {type(error).__name__}: {text}"
    except Exception:  # noqa: BLE001 every other one is a bug
        return f"BUG: {traceback.format_exc()}"


def _check(case: Case, folder: Path) -> str:
    import numpy as np

    import o3d_relief as rel
    from o3d_relief.scene.arrays import MeshArrays, to_open3d
    from o3d_relief.scene.read import read_arrays

    if case.files:
        for name, content in case.files.items():
            (folder / name).write_bytes(content)
        arrays = read_arrays(folder / list(case.files)[-1])
        mesh = to_open3d(arrays) if isinstance(arrays, MeshArrays) else arrays.to_open3d()
    else:
        mesh = _to_cloud(case.arrays) if "points" in case.arrays else _to_mesh(case.arrays)
    if case.picture:
        _try_without_relief(mesh, folder / f"in{case.output}")
    scan = rel.ScanParams(**case.scan) if case.scan else None
    relief = rel.make_relief(mesh, rel.ReliefParams(**case.params), view=rel.View(**case.view), scan=scan)
    made = relief.mesh
    vertices, faces = np.asarray(made.vertices), np.asarray(made.triangles)
    for name in ("vertices", "vertex_normals", "vertex_colors", "triangle_uvs"):
        if not np.isfinite(np.asarray(getattr(made, name))).all():
            return f"BUG: {name} of the relief are not finite"
    if faces.min() < 0 or faces.max() >= len(vertices) or vertices[:, 2].min() < 0:
        return "BUG: the relief has faces without vertices, or lies behind the plane"
    if not np.isfinite(relief.to_scene).all():
        return "BUG: to_scene is not finite"
    json.dumps(relief.report(), allow_nan=False)
    if case.picture:
        rel.render(made, size=(32, 32), plate=True)
    rel.write_mesh(folder / f"out{case.output}", made)
    again = rel.read_mesh(folder / f"out{case.output}")
    if len(again.triangles) != len(faces):
        return "BUG: the relief does not come back from its file"
    if any(path.name.startswith(".") for path in folder.iterdir()):
        return "BUG: a temporary file is left"
    return "relief"


def _try_without_relief(mesh: Any, path: Path) -> None:
    """Draw and write the mesh as it came: either works, or is refused."""
    import o3d_relief as rel

    with suppress(rel.ReliefError):
        rel.render(mesh, size=(32, 32))
    with suppress(rel.ReliefError):
        rel.write_mesh(path, mesh)


def _to_cloud(arrays: dict[str, Any]) -> Any:
    import open3d as o3d

    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(arrays["points"]))
    if "normals" in arrays:
        cloud.normals = o3d.utility.Vector3dVector(arrays["normals"])
    return cloud


def _to_mesh(arrays: dict[str, Any]) -> Any:
    import numpy as np
    import open3d as o3d

    mesh = o3d.geometry.TriangleMesh()
    mesh.vertices = o3d.utility.Vector3dVector(arrays["vertices"])
    mesh.triangles = o3d.utility.Vector3iVector(arrays["faces"].astype(np.int32))
    for name, attribute in (("colors", "vertex_colors"), ("normals", "vertex_normals")):
        if name in arrays:
            setattr(mesh, attribute, o3d.utility.Vector3dVector(arrays[name]))
    if "triangle_uvs" in arrays:
        mesh.triangle_uvs = o3d.utility.Vector2dVector(arrays["triangle_uvs"])
    if "textures" in arrays:
        mesh.textures = [o3d.geometry.Image(np.ascontiguousarray(t)) for t in arrays["textures"]]
        mesh.triangle_material_ids = o3d.utility.IntVector(arrays["material_ids"])
    return mesh
