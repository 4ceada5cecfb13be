"""Other methods that make reliefs, each after its own publication, for comparison.

All work in the relief frame: x to the right, y up, z to the viewer, S at z = 0, and fill the depth that
they are given exactly: what is visible from the front ends between 0 and `depth`. A method that moves the
vertices of the mesh returns their new z; what lies behind S afterwards is for the caller to cut off.
"""
