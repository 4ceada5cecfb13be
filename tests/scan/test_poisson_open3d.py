import os
import subprocess
import sys

import numpy as np
import pytest

from o3d_relief.scan import poisson_open3d
from o3d_relief.scan.poisson_open3d import reconstruct


def ball(count=4000):
    points = np.random.default_rng(0).normal(size=(count, 3))
    return points / np.linalg.norm(points, axis=1, keepdims=True)


class TestItsOwnWarnings:
    """The library below Open3D writes to the process's error stream, past Python."""

    @pytest.fixture
    def noisy(self, monkeypatch):
        make = poisson_open3d.o3d.geometry.TriangleMesh.create_from_point_cloud_poisson

        class Mesh:
            @staticmethod
            def create_from_point_cloud_poisson(*arguments, **options):
                os.write(2, b"[WARNING] FEMTree.Evaluation.inl\n")
                return make(*arguments, **options)

        monkeypatch.setattr(poisson_open3d.o3d.geometry, "TriangleMesh", Mesh)

    @pytest.mark.usefixtures("noisy")
    def test_are_not_heard_but_ours_are(self, capfd):
        os.write(2, b"before\n")
        reconstruct(ball(), ball(), 4, 1, 1.1)
        os.write(2, b"after\n")
        assert capfd.readouterr().err == "before\nafter\n"

    @pytest.mark.usefixtures("noisy")
    def test_the_stream_comes_back_after_an_error(self, capfd):
        with pytest.raises(TypeError, match="incompatible function arguments"):  # of Open3D
            reconstruct(ball(), ball(), -1, 1, 1.1)
        os.write(2, b"after\n")
        assert capfd.readouterr().err == "after\n"

    def test_without_a_stream_it_works_the_same(self):
        code = (
            "import os, numpy as np; os.close(2)\nfrom o3d_relief.scan.poisson import poisson_surface as f\n"
        )
        code += (
            "p = np.random.default_rng(0).normal(size=(500, 3)); p /= np.linalg.norm(p, axis=1)[:, None]\n"
        )
        code += "print(len(f(p, p, depth=4, threads=1)[1]) > 0)"
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
        assert done.stdout == "True\n"
