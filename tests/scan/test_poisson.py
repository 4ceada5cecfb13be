import os
import subprocess
import sys

import numpy as np
import pytest

from o3d_relief.errors import MeshError, ParameterError
from o3d_relief.scan import poisson
from o3d_relief.scan.poisson import depth_for, poisson_surface


def ball(count=4000):
    points = np.random.default_rng(0).normal(size=(count, 3))
    return points / np.linalg.norm(points, axis=1, keepdims=True)


@pytest.mark.parametrize(
    ("extent", "spacing", "depth"), [(100, 1, 7), (1000, 1, 10), (1e9, 1, 11), (3, 1, 4)]
)
def test_cells_are_about_as_wide_as_the_spacing(extent, spacing, depth):
    assert depth_for(extent, spacing) == depth


@pytest.mark.parametrize("extent", [40.0, 57.0, 80.0, 113.0, 900.0])
def test_cells_lie_between_0_84_and_1_68_spacings(extent):
    assert 0.84 <= 1.1 * extent / 2 ** depth_for(extent, 1.0) <= 1.69


@pytest.mark.parametrize(("scale", "offset"), [(1.0, 0.0), (1e-6, 0.0), (1e4, 1e5)])
def test_a_ball_comes_back(scale, offset):
    vertices, faces, density = poisson_surface(ball() * scale + offset, ball(), depth=6, threads=1)
    radius = np.linalg.norm((vertices - offset) / scale, axis=1)
    assert np.abs(radius - 1.0).max() < 0.02
    assert len(density) == len(vertices)
    a, b, c = ((vertices - offset) / scale)[faces].transpose(1, 0, 2)
    assert (np.cross(b - a, c - a) * a).sum() / 6.0 == pytest.approx(4.0 / 3.0 * np.pi, rel=0.02)


def test_the_same_points_give_the_same_bytes():
    first, again = (poisson_surface(ball(), ball(), depth=6, threads=1) for _ in range(2))
    assert all(np.array_equal(one, other) for one, other in zip(first, again, strict=True))


def test_too_few_points():
    with pytest.raises(MeshError, match="at least 50 points, only 49 are left"):
        poisson_surface(ball(49), ball(49), depth=6, threads=1)


@pytest.mark.parametrize("direction", [[1.0, 0, 0], [1.0, 2, 3]])
def test_points_on_a_line(direction):
    points = np.linspace(0, 1, 200)[:, None] * direction
    with pytest.raises(MeshError, match="lie on one line"):
        poisson_surface(points, np.tile([0, 0, 1.0], (200, 1)), depth=6, threads=1)


def test_more_threads_than_processors():
    with pytest.raises(ParameterError, match="threads must be at most"):
        poisson_surface(ball(), ball(), depth=6, threads=(os.cpu_count() or 1) + 1)


class TestItsOwnWarnings:
    """The library below Open3D writes to the process's error stream, past Python."""

    @pytest.fixture
    def noisy(self, monkeypatch):
        make = poisson.o3d.geometry.TriangleMesh.create_from_point_cloud_poisson

        class Mesh:
            @staticmethod
            def create_from_point_cloud_poisson(*arguments, **options):
                os.write(2, b"[WARNING] FEMTree.Evaluation.inl\n")
                return make(*arguments, **options)

        monkeypatch.setattr(poisson.o3d.geometry, "TriangleMesh", Mesh)

    @pytest.mark.usefixtures("noisy")
    def test_are_not_heard_but_ours_are(self, capfd):
        os.write(2, b"before\n")
        poisson_surface(ball(), ball(), depth=4, threads=1)
        os.write(2, b"after\n")
        assert capfd.readouterr().err == "before\nafter\n"

    @pytest.mark.usefixtures("noisy")
    def test_the_stream_comes_back_after_an_error(self, capfd):
        with pytest.raises(TypeError, match="incompatible function arguments"):  # of Open3D
            poisson_surface(ball(), ball(), depth=-1, threads=1)
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
