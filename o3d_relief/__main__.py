"""python -m o3d_relief: the command."""

from o3d_relief.cli import run

if __name__ == "__main__":
    run()
