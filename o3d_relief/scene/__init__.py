"""What comes in: files, meshes, the relief frame."""
