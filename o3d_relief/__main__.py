"""python -m o3d_relief: the command."""

import sys

from o3d_relief.cli import main

if __name__ == "__main__":
    sys.exit(main())
