"""Compression alone against the method at the same depth (figure 11).

python examples/figure_11_compression.py [MESH [OUTPUT]]
"""

import sys

import numpy as np
import open3d as o3d

import o3d_relief as rel


def main(scene: str | None = None, output: str = "figure_11.png", *, panel: int = 460) -> None:
    mesh = rel.read_mesh(scene) if scene else rel.demo_scene()
    mesh.vertex_colors = o3d.utility.Vector3dVector()  # stone: the light alone tells the shape
    method = rel.make_relief(mesh, rel.ReliefParams(k=128, alpha=0.8))
    depth = method.summary()["relief_depth"]
    whole = rel.make_relief(mesh, rel.ReliefParams(k=1)).summary()["relief_depth"]
    plain = rel.make_relief(mesh, rel.ReliefParams(k=1, alpha=min(1.0, depth / whole)))
    pictures, titles, size = [], [], (panel, panel)
    low, high = method.mesh.get_min_bound(), method.mesh.get_max_bound()
    # Close up at what lies closest to the plane in the middle of the scene, where compression costs most.
    middle, reach = 0.5 * (low + high), 0.22 * (high - low)[:2].max()
    near = np.array([middle - reach, middle + reach])
    for name, relief in (("compression alone, k = 1", plain), ("the method, k = 128", method)):
        for yaw, bounds, title in ((40, None, name), (85, None, "from the side"), (0, near, "close up")):
            plate = bounds is None
            pictures.append(
                rel.render(
                    relief.mesh, direction=rel.view_direction(yaw), plate=plate, bounds=bounds, size=size
                )
            )
            titles.append(title)
    rel.save_png(output, rel.contact_sheet(pictures, 3, titles=titles))
    for name, relief in (("compression alone", plain), ("the method", method)):
        angles = rel.measure_relief(mesh, relief, size=max(panel, 64)).normal_angles
        print(f"{name}: normals turned by {angles[0]:.1f}° in front, {np.mean(angles):.1f}° from seven sides")


if __name__ == "__main__":
    from start import start

    start(main, __doc__, sys.argv[1:])
