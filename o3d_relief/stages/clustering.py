"""k-means on x and y (section 3.2)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from sklearn.cluster import KMeans
from threadpoolctl import threadpool_limits

__all__ = ["cluster_vertices"]

_CELLS = 256
"""Side of the grid of cells whose weighted means stand for their vertices on large meshes."""

_BITS = 28
"""The extent is divided into 2^28 steps: fine enough for the grid of the scene, and the sum of 2^25
coordinates still is a whole number of them in float64."""

_SAMPLES_PER_CLUSTER = 32
"""Cells are used where they leave at least this many samples for each cluster."""


def cluster_vertices(
    xy: NDArray[np.float64], k: int, *, seed: int = 0
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Partition vertices by k-means on x and y only.

    The scene is not partitioned in depth: one cluster is a column through all its layers. scikit-learn's
    KMeans runs on the vertices or, where there are more than 256 x 256 of them, on the weighted means of
    the cells of a 256 x 256 grid, and each vertex then goes to its nearest centre.

    Parameters
    ----------
    xy : (n, 2) float64
    k : int
        Number of clusters; one for each distinct position where there are fewer than k of them.
    seed : int

    Returns
    -------
    labels : (n,) int64
    centers : (k, 2) float64

    Examples
    --------
    >>> labels, centers = cluster_vertices(np.array([[0.0, 0], [0, 1], [9, 0], [9, 1]]), 2)
    >>> sorted(centers.tolist())
    [[0.0, 0.5], [9.0, 0.5]]
    """
    samples, weights = _samples(xy, k)
    kmeans = KMeans(n_clusters=min(k, _distinct(samples)), n_init=1, random_state=seed)
    # The order in which threads add up their partial means would change the last digits. This is about all
    # threads, those of scikit-learn as well, not only the linear algebra's.
    with threadpool_limits(limits=1):
        kmeans.fit(samples, sample_weight=weights)
    centers = np.asarray(kmeans.cluster_centers_, dtype=np.float64)
    _, labels = cKDTree(centers).query(xy)
    return np.asarray(labels, dtype=np.int64), centers


def _samples(xy: NDArray[np.float64], k: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return what stands for the vertices in the k-means: (s, 2) positions and (s,) weights.

    In an order of their own, so that the seeding does not depend on how the vertices are numbered.
    """
    low = xy.min(axis=0)
    extent = float((xy.max(axis=0) - low).max())
    if len(xy) > _CELLS**2 and extent > 0.0:
        # Whole steps: their sums are exact, whatever the order of the vertices.
        step = 2.0 ** (np.ceil(np.log2(extent)) - _BITS)
        off = np.rint((xy - low) / step)
        cell = np.minimum(off // (extent / step / _CELLS), _CELLS - 1).astype(np.int64) @ [1, _CELLS]
        weights = np.bincount(cell, minlength=_CELLS**2).astype(np.float64)
        full = weights > 0
        if full.sum() >= _SAMPLES_PER_CLUSTER * k:
            sums = np.stack([np.bincount(cell, weights=c, minlength=_CELLS**2) for c in off.T], axis=1)
            return low + step * (sums[full] / weights[full, None]), weights[full]
    return xy[np.lexsort(xy.T)], np.ones(len(xy))


def _distinct(samples: NDArray[np.float64]) -> int:
    """Count the different positions; equal ones follow each other."""
    return 1 + int((samples[1:] != samples[:-1]).any(axis=1).sum())
