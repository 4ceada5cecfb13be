"""The method step by step, on plain arrays: python examples/single_stages.py [MESH]."""

import sys

import numpy as np

import o3d_relief as rel
from o3d_relief.scene.frame import relief_frame, to_relief_units
from o3d_relief.scene.weld import weld
from o3d_relief.stages.attenuation import (
    actions,
    differentials,
    nearest_neighbours,
    new_heights,
    relative_differentials,
    select_points,
)
from o3d_relief.stages.clustering import cluster_vertices
from o3d_relief.stages.compression import compress
from o3d_relief.stages.construction import construct
from o3d_relief.stages.visibility import visible_vertices


def main(scene: str | None = None) -> None:
    mesh = rel.read_mesh(scene) if scene else rel.demo_scene()
    vertices, faces = np.array(mesh.vertices), np.array(mesh.triangles, dtype=np.int64)

    frame = relief_frame(vertices, front=(0, 0, 1), up=(0, 1, 0))
    welded = weld(to_relief_units(vertices, frame, on_grid=True), faces)
    vertices, faces = welded.vertices, welded.faces

    visible = visible_vertices(vertices, faces)
    labels, centers = cluster_vertices(vertices[:, :2], 64)
    index, _ = select_points(vertices, visible, labels, centers)
    points = vertices[index]

    neighbours = nearest_neighbours(points[:, :2], symmetric=False)
    rho = relative_differentials(differentials(points[:, 2], neighbours))
    action = actions(rho, discard_above=0.6, attach_below=0.3)
    heights = new_heights(points, rho, action, np.full(len(points), 0.2))
    kept = heights.action != "discard"
    print({name: int((heights.action == name).sum()) for name in ("attach", "scale", "discard")})

    laplacian, _ = rel.cotangent_laplacian(vertices, faces)
    built = construct(vertices, laplacian, index[kept], heights.new_height[kept])
    _, z = compress(built.z, alpha=0.8)
    before, after = np.ptp(vertices[visible, 2]), np.ptp(z[visible])
    print(f"visible depth in relief units: {before:.1f} -> {after:.1f}")


if __name__ == "__main__":
    from start import start

    start(main, __doc__, sys.argv[1:])
