import numpy as np
import pytest

from o3d_relief.stages.compression import alpha_for_depth, compress


def test_hand_numbers():
    ratio, z = compress(np.array([2.0, 6.0, 10.0]), alpha=0.8, alpha_min=0.2)
    assert ratio == pytest.approx([0.2, 0.5, 0.8])
    assert z == pytest.approx([0.4, 3.0, 8.0])


def test_half_of_alpha_is_the_default_minimum():
    ratio, _ = compress(np.array([0.0, 10.0]), alpha=0.6)
    assert ratio.tolist() == [0.3, 0.6]


def test_range_starts_at_the_cut_where_something_lies_behind():
    ratio, z = compress(np.array([-8.0, 0.0, 5.0, 10.0]), alpha=0.4)
    assert ratio == pytest.approx([0.2, 0.2, 0.3, 0.4])
    assert np.array_equal(np.sign(z), [-1, 0, 1, 1])


def test_order_is_kept():
    z = np.sort(np.random.default_rng(0).uniform(-5, 30, 500))
    assert (np.diff(compress(z, alpha=0.3, alpha_min=0.01)[1]) > 0).all()


def test_flat_relief_is_scaled():
    assert compress(np.full(3, 4.0), alpha=0.5)[1].tolist() == [2.0, 2.0, 2.0]


@pytest.mark.parametrize("depth", [0.5, 3.0, 19.9])
def test_depth_is_met_exactly(depth):
    z = np.random.default_rng(0).uniform(-5, 20, 500)
    assert compress(z, alpha=alpha_for_depth(z, depth))[1].max() == pytest.approx(min(depth, z.max()))


def test_shallower_relief_is_not_stretched():
    assert alpha_for_depth(np.array([0.0, 2.0]), 5.0) == 1.0
    assert alpha_for_depth(np.array([-1.0, 0.0]), 5.0) == 1.0
