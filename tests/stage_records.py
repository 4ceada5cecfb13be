"""Records of all stages of a small scene, made up, for the pictures of them."""

import numpy as np
import open3d as o3d

from o3d_relief.records import (
    AttenuationStage,
    ClustersStage,
    CompressionStage,
    ConstructionStage,
    OrderStage,
    PerspectiveStage,
    RestorationStage,
    SceneStage,
    TrimStage,
    VisibilityStage,
)


def make_sphere(depth=1.0):
    """Return a ball of diameter 100, flattened in depth, that stands on z = 0."""
    sphere = o3d.geometry.TriangleMesh.create_sphere(50.0, 10)
    vertices = np.asarray(sphere.vertices) * [1.0, 1.0, depth]
    vertices[:, 2] -= vertices[:, 2].min()
    return vertices, np.asarray(sphere.triangles).astype(np.int64)


def make_stages():
    vertices, faces = make_sphere()
    n = len(vertices)
    z = 0.5 * vertices[:, 2]
    labels = (vertices[:, 0] > 0).astype(np.int64) + 2 * (vertices[:, 1] > 0)
    index = np.array([0, 20, 40, 60])
    action = np.array(["attach", "scale", "discard", "scale"])
    error = np.zeros(n)
    error[np.argmax(vertices[:, 2])] = 0.8
    records = [
        SceneStage(
            vertices=vertices.copy(),
            faces=faces,
            welded_index=np.arange(n),
            welded_face=np.arange(len(faces)),
            unit=1.0,
        ),
        PerspectiveStage(vertices=vertices * [0.8, 0.8, 1.0]),
        VisibilityStage(visible=vertices[:, 2] > 50.0),
        ClustersStage(labels=labels, centers=np.array([[-25.0, -25], [25, -25], [-25, 25], [25, 25]])),
        AttenuationStage(
            index=index,
            cluster=np.arange(4),
            height=vertices[index, 2],
            differential=np.full(4, 0.5),
            rho=np.full(4, 0.5),
            beta=np.full(4, 0.2),
            action=action,
            new_height=np.where(action == "discard", np.nan, 0.5 * vertices[index, 2]),
        ),
        ConstructionStage(z=z - 3.0),
        RestorationStage(order_error=error, solved=error > 0.2, z=z),
        OrderStage(z=z + 2.0 * (labels == 0), counts={"pairs_corrected": 7}),
        CompressionStage(alpha=np.full(n, 0.5), z=0.5 * z),
        TrimStage(),
    ]
    return {record.name: record for record in records}
