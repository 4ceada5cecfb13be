"""Reliefs of different kinds of scenes (figure 13): python examples/figure_13_gallery.py [MESH ...].

Without a mesh: the built-in scene from two sides, one long coil, and a still life of many parts.
"""

import sys

import numpy as np
import open3d as o3d

import o3d_relief as rel

Mesh = o3d.geometry.TriangleMesh


def coil(steps: int = 700, around: int = 24) -> Mesh:
    """Make a tube along a torus knot: it passes over and under itself."""
    t = np.linspace(0.0, 2.0 * np.pi, steps, endpoint=False)
    ring = 30.0 + 13.0 * np.cos(5.0 * t)
    path = np.column_stack([ring * np.cos(3.0 * t), ring * np.sin(3.0 * t), 16.0 * np.sin(5.0 * t)])
    along = np.roll(path, -1, axis=0) - np.roll(path, 1, axis=0)
    out = np.cross(along, (0.0, 0.0, 1.0))
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    up = np.cross(out, along / np.linalg.norm(along, axis=1, keepdims=True))
    turn = np.linspace(0.0, 2.0 * np.pi, around, endpoint=False)[:, None, None]
    places = (path + 4.0 * (np.cos(turn) * out + np.sin(turn) * up)).transpose(1, 0, 2).reshape(-1, 3)
    a, b = np.meshgrid(np.arange(steps), np.arange(around), indexing="ij")
    number = (a * around + b).ravel()
    side = (a * around + (b + 1) % around).ravel()
    ahead, across = (number + around) % (steps * around), (side + around) % (steps * around)
    faces = np.concatenate(
        [np.column_stack([number, side, across]), np.column_stack([number, across, ahead])]
    )
    return Mesh(o3d.utility.Vector3dVector(places), o3d.utility.Vector3iVector(faces.astype(np.int32)))


def still_life() -> Mesh:
    """Put some bodies on a table, one in front of the other."""
    bodies = [
        (Mesh.create_box(90, 4, 50).subdivide_midpoint(5), (-45, -4, -25)),
        (Mesh.create_sphere(11, 60), (-22, 11, 6)),
        (Mesh.create_cylinder(9, 40, 60, 30), (20, 20, -8)),
        (Mesh.create_torus(12, 3.5, 80, 40), (22, 12, 14)),
        (Mesh.create_cone(10, 30, 60, 30), (-2, 0, -10)),
    ]
    scene = Mesh()
    for number, (body, place) in enumerate(bodies):
        if number in (2, 4):  # along y
            body.rotate(body.get_rotation_matrix_from_xyz((-np.pi / 2, 0, 0)), (0, 0, 0))
        scene += body.translate(place)
    return scene


def main(*scenes: str, output: str = "figure_13.png", panel: int = 420) -> None:
    found = [(rel.read_mesh(scene), 128, rel.View()) for scene in scenes]
    if not found:
        found = [(rel.demo_scene(), 128, rel.View()), (rel.demo_scene(), 128, rel.View(front="x"))]
        # Smooth bodies show every dent: fewer points.
        found += [(coil(), 64, rel.View()), (still_life(), 16, rel.View(front=(0.3, 0.35, 1.0)))]
    above, below = [], []
    for mesh, k, view in found:
        relief = rel.make_relief(mesh, rel.ReliefParams(k=k, alpha=0.8), view=view)
        placed = mesh.transform(np.linalg.inv(relief.to_scene))
        turned = rel.view_direction(30, 10)
        above.append(rel.render(placed, direction=turned, size=(panel, panel)))
        below.append(rel.render(relief.mesh, direction=turned, size=(panel, panel), plate=True))
        summary = relief.summary()
        print(f"depth {summary['scene_depth']:.4g} -> {summary['relief_depth']:.4g}")
    rel.save_png(output, rel.contact_sheet(above + below, len(found)))


if __name__ == "__main__":
    from start import start

    start(main, __doc__, sys.argv[1:])
