"""Pairs as rows of a matrix."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from o3d_relief.bounds.pairs import Pairs

__all__ = ["gap_rows"]


def gap_rows(pairs: Pairs, n: int) -> sp.csr_array:
    """Return the matrix R, (p, n), with which R z is the height of the upper less that of the lower.

    Like `Pairs.difference`, but without sorting the entries: there may be a million pairs.
    """
    columns = np.concatenate([pairs.upper, pairs.lower], axis=1)
    values = np.concatenate([pairs.upper_weights, -pairs.lower_weights], axis=1)
    count, width = columns.shape
    starts = np.arange(count + 1, dtype=np.int64) * width
    kind = np.int32 if max(count * width, n) < 2**31 else np.int64
    parts = values.ravel(), columns.ravel().astype(kind), starts.astype(kind)
    return sp.csr_array(parts, shape=(count, n))
