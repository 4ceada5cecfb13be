"""The paper's appendices, literal, dense and slow: loops and library least squares, nothing shared."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from shapes import Shape


def cotangent(vertices: NDArray[np.float64], at: int, one: int, other: int) -> float:
    a, b = vertices[one] - vertices[at], vertices[other] - vertices[at]
    return float(a @ b / np.linalg.norm(np.cross(a, b)))


def cotangent_matrix(shape: Shape) -> NDArray[np.float64]:
    """Appendix III without the division by the Voronoi area: sum of w_j (v_i - v_j) as a matrix."""
    vertices, faces = shape
    matrix = np.zeros((len(vertices), len(vertices)))
    for face in faces:
        for corner in range(3):
            k, i, j = face[corner], face[(corner + 1) % 3], face[(corner + 2) % 3]
            weight = 0.5 * cotangent(vertices, k, i, j)
            matrix[i, j] -= weight
            matrix[j, i] -= weight
            matrix[i, i] += weight
            matrix[j, j] += weight
    return matrix


def voronoi_areas(shape: Shape) -> NDArray[np.float64]:
    vertices, faces = shape
    areas = np.zeros(len(vertices))
    for face in faces:
        for corner in range(3):
            i, j, k = face[corner], face[(corner + 1) % 3], face[(corner + 2) % 3]
            areas[i] += np.sum((vertices[i] - vertices[j]) ** 2) * cotangent(vertices, k, i, j) / 8
            areas[i] += np.sum((vertices[i] - vertices[k]) ** 2) * cotangent(vertices, j, i, k) / 8
    return areas


def construct(shape: Shape, index: NDArray[np.int64], height: NDArray[np.float64]) -> NDArray[np.float64]:
    """Appendix V: rows of L for the free vertices, rows of the identity for the fixed ones."""
    vertices, _ = shape
    laplacian = cotangent_matrix(shape) / voronoi_areas(shape)[:, None]
    n = len(vertices)
    differential = laplacian @ vertices[:, 2]
    system, target = laplacian.copy(), differential.copy()
    for point, z in zip(index, height, strict=True):
        system[point] = np.eye(n)[point]
        target[point] = z
    return np.linalg.solve(system, target)


def restore(
    shape: Shape, z: NDArray[np.float64], high: NDArray[np.bool_], blend: float
) -> NDArray[np.float64]:
    """Appendix VI with L = I - D^-1 A and D the row sums of the weights."""
    vertices, _ = shape
    weights = -cotangent_matrix(shape)
    np.fill_diagonal(weights, 0.0)
    laplacian = np.eye(len(z)) - weights / weights.sum(axis=1)[:, None]
    blended = blend * laplacian + (1 - blend) * laplacian @ laplacian
    system, target = blended.copy(), blended @ vertices[:, 2]
    for i in np.flatnonzero(~high):
        system[i] = np.eye(len(z))[i]
        target[i] = z[i]
    return np.linalg.solve(system, target)


def order_errors(
    vertices: NDArray[np.float64],
    z: NDArray[np.float64],
    index: NDArray[np.int64],
    radii: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Eq. 8 for heights that all differ."""
    errors = np.zeros(len(z))
    for point, radius in zip(index, radii, strict=True):
        around = [i for i in range(len(z)) if math.dist(vertices[i], vertices[point]) <= radius]
        before = sorted(around, key=lambda i: vertices[i, 2])
        after = sorted(around, key=lambda i: z[i])
        for i in around:
            errors[i] = max(errors[i], abs(after.index(i) - before.index(i)) / len(around))
    return errors


def neighbours(points: NDArray[np.float64], count: int = 4) -> list[set[int]]:
    """The nearest neighbours in x and y, made symmetric."""
    found = []
    for i in range(len(points)):
        others = sorted(
            (j for j in range(len(points)) if j != i), key=lambda j: math.dist(points[i, :2], points[j, :2])
        )
        found.append(set(others[:count]))
    for i, near in enumerate(found):
        for j in list(near):
            found[j].add(i)
    return found


def heights_energy(
    points: NDArray[np.float64], attached: NDArray[np.bool_], beta: float, new: NDArray[np.float64]
) -> float:
    """The cost function of Eq. 5 at the heights `new`."""
    near = neighbours(points)
    energy = 0.0
    for i in range(len(points)):
        old_difference = points[i, 2] - sum(points[j, 2] for j in near[i]) / len(near[i])
        new_difference = new[i] - sum(new[j] for j in near[i]) / len(near[i])
        energy += (math.atan(beta * old_difference) / beta - new_difference) ** 2
        if attached[i]:
            energy += new[i] ** 2
    return energy
