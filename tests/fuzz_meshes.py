"""Meshes with every defect that real ones have, and with some that they should not have."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from hypothesis import strategies as st

from shapes import Shape, bust, exploded, grid, hills, joined, moved, sphere

SHAPES: dict[str, Shape] = {
    "bust": bust(6),
    "hills": hills(7),
    "flat": grid(5),
    "ball": sphere(4),
    "parts": joined(bust(5), moved(sphere(3, 8.0), (0, 0, 90)), moved(hills(4), (5, 5, -70))),
    "triangle": (np.array([[0.0, 0, 0], [1, 0, 0.2], [0, 1, 0.5]]), np.array([[0, 1, 2]])),
}

SIZES = (1e-300, 1e-60, 1e-30, 1e-9, 1e-6, 1e-3, 1e3, 5e5, 5e6, 1e15, 1e38, 1e39, 1e154, 1e300)
_VALUES = (np.nan, np.inf, -np.inf, 0.0, *SIZES)

Array = np.ndarray
Generator = np.random.Generator


def with_value(vertices: Array, number: float, rng: Generator) -> Array:
    vertices = vertices.copy()
    vertices.ravel()[rng.integers(vertices.size, size=1 + int(rng.integers(3)))] = number
    return vertices


def _one_axis(rng: Generator) -> Array:
    return np.arange(3) == rng.integers(3)


MOVES: dict[str, Callable[[Array, float, Generator], Array]] = {
    "far": lambda v, size, rng: v + size * rng.normal(size=3),
    "scale": lambda v, size, rng: v * size,
    "scale axis": lambda v, size, rng: v * np.where(_one_axis(rng), size, 1.0),
    "flatten": lambda v, size, rng: v * ~_one_axis(rng),
    "edge-on": lambda v, size, rng: v * [1.0, size, 1.0],
    "jitter": lambda v, size, rng: v + rng.normal(scale=size, size=v.shape),
    "tilt": lambda v, size, rng: v @ np.linalg.qr(rng.normal(size=(3, 3)))[0].T,
    "round": lambda v, size, rng: np.round(v / size) * size,
}


def _some(faces: Array, rng: Generator) -> Array:
    return faces[rng.random(len(faces)) < rng.choice([0.1, 0.5, 1.0])]


def _fins(vertices: Array, faces: Array, rng: Generator) -> Shape:
    third = rng.integers(len(vertices), size=len(faces))
    return vertices, np.concatenate([faces, _some(np.column_stack([faces[:, :2], third]), rng)])


def _hole(vertices: Array, faces: Array, rng: Generator) -> Shape:
    return vertices, rng.permutation(faces)[: 1 + int(0.7 * len(faces))]


def _flip(vertices: Array, faces: Array, rng: Generator) -> Shape:
    turned = rng.random(len(faces)) < rng.choice([0.1, 0.5, 1.0])
    return vertices, np.where(turned[:, None], faces[:, ::-1], faces)


def _point_on_edge(vertices: Array, faces: Array, rng: Generator, off: float) -> Shape:
    a, b = rng.choice(faces)[:2]
    middle = vertices[a] + (vertices[b] - vertices[a]) * rng.random() + off
    return np.vstack([vertices, middle]), np.vstack([faces, [a, b, len(vertices)]])


def _index(vertices: Array, faces: Array, rng: Generator, wrong: int) -> Shape:
    faces = faces.copy()
    faces.ravel()[rng.integers(faces.size)] = wrong
    return vertices, faces


def _piece(vertices: Array, faces: Array, rng: Generator) -> Shape:
    own = rng.normal(scale=60, size=(3, 3))
    return joined((vertices, faces), (own, np.array([[0, 1, 2]])))


REBUILDS: dict[str, Callable[[Array, Array, Generator], Shape]] = {
    "explode": lambda v, f, rng: exploded((v, f)),
    "double": lambda v, f, rng: (v, np.concatenate([f, _some(f, rng)[:, ::-1]])),
    "duplicate": lambda v, f, rng: (v, np.concatenate([f, _some(f, rng)])),
    "fins": _fins,
    "flip": _flip,
    "hole": _hole,
    "sliver": lambda v, f, rng: _point_on_edge(v, f, rng, 1e-12),
    "zero area": lambda v, f, rng: _point_on_edge(v, f, rng, 0.0),
    "repeat corner": lambda v, f, rng: (v, np.vstack([f, f[0, [0, 0, 1]], f[0, [1, 1, 1]]])),
    "unreferenced": lambda v, f, rng: (np.vstack([rng.normal(scale=1e3, size=(3, 3)), v]), f + 3),
    "unreferenced nan": lambda v, f, rng: (np.vstack([v, [[np.nan, np.inf, 1e300]]]), f),
    "piece": _piece,
    "few": lambda v, f, rng: (v, f[: 1 + int(rng.integers(3))]),
    "shuffle": lambda v, f, rng: (v, rng.permutation(f)),
    "copies": lambda v, f, rng: joined((v, f), (v + 0.0, f), (v + np.array([0, 0, 1e-4]), f)),
    "stack": lambda v, f, rng: joined(*((v + np.array([0, 0, 30 * i]), f) for i in range(3))),
}
DAMAGES: dict[str, Callable[[Array, Array, Generator], Shape]] = {
    "above": lambda v, f, rng: _index(v, f, rng, len(v) + int(rng.choice([0, 1, 10**6]))),
    "negative": lambda v, f, rng: _index(v, f, rng, -int(rng.choice([1, 2, 2**31 - 1]))),
}
ATTRIBUTES = ("colors", "normals", "uvs", "textures")

_chosen = st.tuples(
    st.sampled_from([*MOVES, *REBUILDS, *ATTRIBUTES, *ATTRIBUTES, "value"]), st.integers(0, 1023)
)
defects = st.tuples(
    st.lists(_chosen, max_size=5), st.sampled_from([None] * 20 + list(DAMAGES)), st.integers(0, 1023)
)


@np.errstate(all="ignore")
def damaged(name: str, chosen: list[tuple[str, int]], damage: str | None, seed: int) -> dict[str, Any]:
    """Return the arrays of a mesh: vertices, faces, and what attributes the defects have added."""
    vertices, faces = SHAPES[name]
    extra: dict[str, Any] = {}
    for defect, amount in chosen:
        rng = np.random.default_rng(amount)
        if defect in MOVES:
            vertices = MOVES[defect](vertices, SIZES[amount % len(SIZES)], rng)
        elif defect in REBUILDS:
            vertices, faces = REBUILDS[defect](vertices, faces, rng)
        elif defect == "value":
            vertices = with_value(vertices, _VALUES[amount % len(_VALUES)], rng)
        else:
            extra |= _attributes(defect, len(vertices), len(faces), amount, rng)
    if damage is not None:
        vertices, faces = DAMAGES[damage](vertices, faces, np.random.default_rng(seed))
    return {"vertices": vertices, "faces": faces} | extra


def _attributes(defect: str, n: int, m: int, amount: int, rng: np.random.Generator) -> dict[str, Any]:
    """Make attributes of the right length, of a wrong one, or with odd values."""
    wrong = amount % 3 == 0
    more = int(rng.integers(1, 4)) if wrong else 0
    odd = rng.choice([np.nan, np.inf, -5.0, 1e30, 0.5])

    def values(rows: int, columns: int) -> Array:
        table = rng.random((rows + more, columns))
        if amount % 2 and table.size:
            table.ravel()[rng.integers(table.size)] = odd
        return table

    if defect in ("colors", "normals"):
        return {defect: values(n, 3)}
    if defect == "uvs":
        return {"triangle_uvs": values(3 * m, 2)}
    kinds = [(2, 3, 3), (1, 1, 3), (2, 2), (2, 2, 1), (2, 2, 4), (0, 0, 3)]
    textures = []
    for _ in range(int(rng.integers(1, 4))):
        shape = kinds[int(rng.integers(len(kinds)))]
        kind = rng.choice(["u1", "u2", "f4"])
        textures.append((rng.random(shape) * (1 if kind == "f4" else 200)).astype(kind))
    ids = rng.integers(-1 if amount % 5 == 0 else 0, len(textures) + (amount % 2), m + more)
    return {"triangle_uvs": values(3 * m, 2), "textures": textures, "material_ids": ids.astype(np.int32)}
