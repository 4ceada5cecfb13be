"""Small point clouds of every format, made in code, and clouds with the defects of real scans."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any

import laspy
import numpy as np
import open3d as o3d
from hypothesis import strategies as st

from fuzz_meshes import MOVES, SIZES, Array, Generator, with_value
from shapes import Shape, bust, grid, hills, joined, moved, sphere

_COUNT = 150


def _sampled(shape: Shape) -> tuple[Array, Array]:
    """Draw points of a shape, and the normals there."""
    vertices, faces = shape
    rng = np.random.default_rng(0)
    a, b, c = vertices[faces].transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    area = np.linalg.norm(normal, axis=1)
    chosen = rng.choice(len(faces), _COUNT, p=area / area.sum())
    s, t = np.sqrt(rng.random((_COUNT, 1))), rng.random((_COUNT, 1))
    points = (1 - s) * a[chosen] + s * (1 - t) * b[chosen] + s * t * c[chosen]
    return points, normal[chosen] / area[chosen, None]


def _text(*columns: Array) -> str:
    return "".join(" ".join(f"{value:.6g}" for value in row) + "\n" for row in np.column_stack(columns))


def _body() -> tuple[Array, Array, Array]:
    points, normals = _sampled(bust(12))
    return points, normals, np.random.default_rng(1).integers(0, 256, points.shape)


def _ply() -> bytes:
    points, normals, colors = _body()
    names = [*"xyz", "nx", "ny", "nz", "red", "green", "blue"]
    rows = np.zeros(len(points), dtype=[(name, "<f4" if at < 6 else "u1") for at, name in enumerate(names)])
    for name, column in zip(names, [*points.T, *normals.T, *colors.T], strict=True):
        rows[name] = column
    head = ["ply", "format binary_little_endian 1.0", f"element vertex {len(rows)}"]
    head += [f"property {'float' if at < 6 else 'uchar'} {name}" for at, name in enumerate(names)]
    return "\n".join([*head, "end_header\n"]).encode() + rows.tobytes()


def _pcd(**how: bool) -> bytes:
    points, normals, colors = _body()
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    cloud.normals = o3d.utility.Vector3dVector(normals)
    cloud.colors = o3d.utility.Vector3dVector(colors / 255)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.pcd"
        o3d.io.write_point_cloud(str(path), cloud, **how)
        return path.read_bytes()


def _organised() -> bytes:
    points = hills(12)[0]
    points[::7] = np.nan  # where the camera saw nothing
    head = "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 12\nHEIGHT 12\n"
    return (head + "VIEWPOINT 0 0 300 1 0 0 0\nPOINTS 144\nDATA ascii\n" + _text(points)).encode()


def _las(*, packed: bool) -> bytes:
    points, _, colors = _body()
    las = laspy.LasData(laspy.LasHeader(point_format=2, version="1.2"))
    las.x, las.y, las.z = points.T
    las.red, las.green, las.blue = colors.T
    stream = BytesIO()
    las.write(stream, do_compress=packed)
    return stream.getvalue()


CLOUDS: dict[str, Callable[[], dict[str, bytes]]] = {
    "ply_cloud": lambda: {"a.ply": _ply()},
    "pcd": lambda: {"a.pcd": _pcd(write_ascii=True)},
    "pcd_binary": lambda: {"a.pcd": _pcd()},
    "pcd_packed": lambda: {"a.pcd": _pcd(compressed=True)},
    "pcd_organised": lambda: {"a.pcd": _organised()},
    "xyz": lambda: {"a.xyz": _text(*_body()).encode()},
    "pts": lambda: {"a.pts": f"{_COUNT}\n{_text(_body()[0], np.arange(_COUNT), _body()[2])}".encode()},
    "las": lambda: {"a.las": _las(packed=False)},
    "laz": lambda: {"a.laz": _las(packed=True)},
}
"""Files by name, as `fuzz_files.SAMPLES`."""

SHAPES: dict[str, Shape] = {
    "body": bust(12),
    "sheet": hills(12),
    "wall": grid(8),
    "two": joined(sphere(8), moved(sphere(8, 20.0), (90, 0, 0))),
}


def _near(points: Array, rng: Generator) -> Array:
    return points[np.argsort(np.linalg.norm(points - rng.choice(points), axis=1))]


CHANGES: dict[str, Callable[[Array, float, Generator], Array]] = {
    "stray": lambda p, size, rng: np.vstack([p, rng.normal(scale=300, size=(20, 3))]),
    "hole": lambda p, size, rng: _near(p, rng)[int(rng.integers(1, 60)) :],
    "few": lambda p, size, rng: rng.permutation(p)[: int(rng.integers(1, 80))],
    "clump": lambda p, size, rng: np.vstack([p, p[0] + rng.normal(scale=1e-7, size=(60, 3))]),
    "repeat": lambda p, size, rng: np.vstack([p, p]),
    "line": lambda p, size, rng: p * [1.0, 0.0, 0.0],
    "floor": lambda p, size, rng: np.vstack([p, rng.uniform(-150, 150, (150, 3)) * [1, 0, 1] + [0, -60, 0]]),
    "value": lambda p, size, rng: with_value(p, size, rng) if len(p) else p,
    "nan": lambda p, size, rng: with_value(p, np.nan, rng) if len(p) else p,
}

_NORMALS: dict[str, Callable[[Array, Generator], Array]] = {
    "own": lambda n, rng: n,
    "inwards": lambda n, rng: -5.0 * n,
    "mixed": lambda n, rng: n * rng.choice([-1.0, 1.0], (len(n), 1)),
    "random": lambda n, rng: rng.normal(size=n.shape),
    "zero": lambda n, rng: 0.0 * n,
    "odd": lambda n, rng: with_value(n, rng.choice([np.nan, np.inf, 1e300]), rng),
}

cloud_defects = st.tuples(
    st.sampled_from(list(SHAPES)),
    st.sampled_from([None, None, *_NORMALS]),
    st.lists(st.tuples(st.sampled_from([*MOVES, *CHANGES]), st.integers(0, 1023)), max_size=3),
)
scans = st.fixed_dictionaries(
    {},
    optional={
        "sensor": st.sampled_from([(0.0, 0.0, 500.0), (1e300, 0.0, 0.0), (0.0, 0.0, 0.0)]),
        "remove_ground": st.booleans(),
        "file_normals": st.booleans(),
        "depth": st.sampled_from([3, 5, 7]),
        "outliers": st.sampled_from([None, 1e-9, 2.0, 1e9]),
        "max_hole": st.sampled_from([0.0, 3.0, 1e9]),
        "min_part": st.sampled_from([0.0, 0.5, 1.0]),
    },
)


@np.errstate(all="ignore")
def damaged_cloud(name: str, kind: str | None, chosen: list[tuple[str, int]]) -> dict[str, Any]:
    """Return the arrays of a cloud: points, and the normals of its kind."""
    points, normals = _sampled(SHAPES[name])
    extra = {} if kind is None else {"normals": _NORMALS[kind](normals, np.random.default_rng(3))}
    for change, amount in chosen:
        if len(points) == 0:  # holes have taken all
            break
        rng = np.random.default_rng(amount)
        points = (MOVES | CHANGES)[change](points, SIZES[amount % len(SIZES)], rng)
    return {"points": points} | {key: values for key, values in extra.items() if len(values) == len(points)}
