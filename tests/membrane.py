"""A membrane on bumps: a quadratic program with bounds, and its path."""

import numpy as np
import scipy.sparse as sp

from o3d_relief.linalg.central_path import CentralPath
from o3d_relief.linalg.laplacian import cotangent_laplacian
from shapes import hills


def obstacle(side=40):
    """A membrane that is pulled down onto bounds, and its path."""
    vertices, faces = hills(side)
    n = len(vertices)
    form = (cotangent_laplacian(vertices, faces)[0] + 1e-3 * sp.eye_array(n)).tocsr()
    bumps = -1.0 - np.cos(vertices[:, 0] / 4.0) * np.cos(vertices[:, 1] / 4.0)
    none = sp.csr_array((0, n)), np.zeros(0)
    bounds = bumps, np.full(n, np.inf)
    path = CentralPath(form, np.full(n, -0.5), np.zeros(n), np.ones(n), *bounds, *none, vertices)
    return path, vertices
