"""A relief of a mesh file, or of the built-in scene: python examples/first_relief.py [MESH [OUTPUT]]."""

import sys
from pathlib import Path

import o3d_relief as rel


def main(scene: str | None = None, output: str = "relief.ply") -> None:
    mesh = rel.read_mesh(scene) if scene else rel.demo_scene()
    relief = rel.make_relief(
        mesh,
        rel.ReliefParams(k=128, beta=0.2, alpha=0.8),
        on_stage=lambda stage: print(f"{stage.name:<13}{stage.seconds:6.2f} s  {dict(stage.counts)}"),
    )
    rel.write_mesh(Path(output), relief.mesh)
    report = relief.report()
    print(f"depth {report['scene_depth']:.4g} -> {report['relief_depth']:.4g}, written to {output}")


if __name__ == "__main__":
    from start import start

    start(main, __doc__, sys.argv[1:])
