"""Meshes with every defect that real ones have, and with some that they should not have."""

from __future__ import annotations

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

_NUMBERS = (np.nan, np.inf, -np.inf, 0.0, 1e-300, 1e-30, 1e-6, 5e5, 5e6, 1e15, 1e38, 1e39, 1e154, 1e300)
_DEFECTS = (
    "explode", "double", "duplicate", "fin", "flip", "hole", "sliver", "zero area", "needle", "repeat corner",
    "unreferenced", "unreferenced value", "piece", "far", "scale", "scale axis", "flatten", "edge-on", "value", "jitter",
    "few", "weld all", "out of range", "negative", "shuffle", "colors", "uvs", "textures", "normals", "copies",
    "tilt", "stack",
)  # fmt: skip

defects = st.lists(
    st.tuples(st.sampled_from(_DEFECTS), st.integers(0, 1023)), min_size=0, max_size=5
)  # fmt: skip


def damaged(name: str, chosen: list[tuple[str, int]]) -> dict[str, Any]:
    """Return the arrays of a mesh: vertices, faces, and what attributes the defects have added."""
    vertices, faces = (array.copy() for array in SHAPES[name])
    extra: dict[str, Any] = {}
    for defect, amount in chosen:
        rng = np.random.default_rng(amount)
        number = _NUMBERS[amount % len(_NUMBERS)]
        if defect in ("colors", "uvs", "textures", "normals"):
            extra |= _attributes(defect, len(vertices), len(faces), amount, rng)
        elif defect in ("far", "scale", "scale axis", "flatten", "edge-on", "value", "jitter", "tilt", "weld all"):
            vertices = _moved(vertices, defect, number, rng)
        elif len(faces):
            vertices, faces = _rebuilt(vertices, faces, defect, number, rng)
    return {"vertices": vertices, "faces": faces} | extra


def _moved(vertices: np.ndarray, defect: str, number: float, rng: np.random.Generator) -> np.ndarray:
    axis = int(rng.integers(3))
    finite = number if np.isfinite(number) and number > 0 else 1e-9
    with np.errstate(over="ignore", invalid="ignore"):
        match defect:
            case "far":
                return vertices + finite * rng.normal(size=3)
            case "scale":
                return vertices * finite
            case "scale axis":
                return vertices * np.where(np.arange(3) == axis, finite, 1.0)
            case "flatten":
                return vertices * np.where(np.arange(3) == axis, 0.0, 1.0)
            case "edge-on":
                return vertices * np.array([1.0, finite, 1.0])
            case "jitter":
                return vertices + rng.normal(scale=finite, size=vertices.shape)
            case "tilt":
                turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
                return vertices @ turn.T
            case "weld all":
                return np.round(vertices / finite) * finite
            case _:  # value
                vertices = vertices.copy()
                if vertices.size:
                    vertices.ravel()[rng.integers(vertices.size, size=1 + int(rng.integers(3)))] = number
                return vertices


def _rebuilt(
    vertices: np.ndarray, faces: np.ndarray, defect: str, number: float, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    m, n = len(faces), len(vertices)
    some = rng.random(m) < rng.choice([0.1, 0.5, 1.0])
    one = faces[rng.integers(m)]
    match defect:
        case "explode":
            return exploded((vertices, faces)) if faces.min() >= 0 and faces.max() < n else (vertices, faces)
        case "double":
            return vertices, np.concatenate([faces, faces[some][:, ::-1]])
        case "duplicate":
            return vertices, np.concatenate([faces, faces[some]])
        case "fin":
            third = rng.integers(n, size=m)
            return vertices, np.concatenate([faces, np.column_stack([faces[:, :2], third])[some]])
        case "flip":
            return vertices, np.where(some[:, None], faces[:, ::-1], faces)
        case "hole":
            return vertices, faces[~some] if (~some).any() else faces
        case "sliver" | "zero area":
            a, b = vertices[one[0] % n], vertices[one[1] % n]
            thin = 0.0 if defect == "zero area" else 1e-12
            middle = a + (b - a) * rng.random() + thin
            return np.vstack([vertices, middle]), np.vstack([faces, [one[0], one[1], n]])
        case "needle":
            return np.vstack([vertices, vertices[one[0] % n] + 1e-9]), np.vstack([faces, [one[0], one[1], n]])
        case "repeat corner":
            return vertices, np.vstack([faces, [one[0], one[0], one[1]], [one[0]] * 3])
        case "unreferenced":
            return np.vstack([rng.normal(scale=1e3, size=(3, 3)), vertices]), faces + 3
        case "unreferenced value":
            return np.vstack([vertices, np.full((2, 3), number)]), faces
        case "piece":
            return np.vstack([vertices, rng.normal(scale=60, size=(3, 3))]), np.vstack([faces, [n, n + 1, n + 2]])
        case "few":
            return vertices, faces[: 1 + int(rng.integers(3))]
        case "out of range":
            faces = faces.copy()
            faces.ravel()[rng.integers(faces.size)] = n + int(rng.choice([0, 1, 10**6]))
            return vertices, faces
        case "negative":
            faces = faces.copy()
            faces.ravel()[rng.integers(faces.size)] = -int(rng.choice([1, 2, 2**31 - 1]))
            return vertices, faces
        case "shuffle":
            return vertices, rng.permutation(faces)
        case "copies":
            return joined((vertices, faces), (vertices + 0.0, faces), (vertices + [0, 0, 1e-4], faces))
        case _:  # stack
            steps = [(vertices * 1.0 + [0, 0, 30 * i], faces) for i in range(3)]
            return joined(*steps)


def _attributes(defect: str, n: int, m: int, amount: int, rng: np.random.Generator) -> dict[str, Any]:
    """Attributes of the right length, of a wrong one, or with odd values."""
    wrong = amount % 3 == 0
    more = int(rng.integers(1, 4)) if wrong else 0
    odd = rng.choice([np.nan, np.inf, -5.0, 1e30, 0.5])

    def values(rows: int, columns: int) -> np.ndarray:
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
