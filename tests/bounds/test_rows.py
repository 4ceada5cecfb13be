import numpy as np
import pytest

from o3d_relief.bounds.lines import Lines
from o3d_relief.bounds.pairs import Pairs, vertex_pairs
from o3d_relief.bounds.rows import gap_rows, point_rows
from shapes import bust


def test_gap_rows_are_those_of_the_pairs():
    vertices, faces = bust(16)
    pairs = vertex_pairs(Lines(vertices, faces))
    z = np.random.default_rng(0).normal(size=len(vertices))
    assert gap_rows(pairs, len(z)) @ z == pytest.approx(pairs.difference(len(z)) @ z)


def test_no_pairs_are_no_rows():
    assert gap_rows(Pairs.join([]), 4).shape == (0, 4)


def test_the_rows_of_points_give_their_heights():
    vertices, faces = bust(16)
    pairs = vertex_pairs(Lines(vertices, faces))
    z = np.random.default_rng(0).normal(size=len(vertices))
    upper, lower = pairs.heights(z)
    assert point_rows(pairs.upper, pairs.upper_weights, len(z)) @ z == pytest.approx(upper)
    assert point_rows(pairs.lower, pairs.lower_weights, len(z)) @ z == pytest.approx(lower)
