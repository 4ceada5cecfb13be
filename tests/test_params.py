import dataclasses

import numpy as np
import pytest

from o3d_relief import ParameterError, ReliefParams, View


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"k": 0}, "k must be at least 1"),
        ({"k": 2.5}, "k must be a whole number"),
        ({"k": "many"}, "k must be a number"),
        ({"k": True}, "k must be a number"),
        ({"beta": -0.1}, "beta must be at least 0"),
        ({"beta": (0.1, float("nan"))}, "beta must be finite"),
        ({"discard_above": 1.1}, "discard_above must be between 0 and 1"),
        ({"attach_below": 0.7}, "attach_below must not exceed discard_above"),
        ({"max_order_error": -1}, "max_order_error must be between 0 and 1"),
        ({"blend": 2}, "blend must be between 0 and 1"),
        ({"alpha": 0}, "alpha must be greater than 0 and at most 1"),
        ({"alpha": 1.5}, "alpha must be greater than 0 and at most 1"),
        ({"alpha": 0.4, "alpha_min": 0.5}, "alpha_min must not exceed alpha"),
        ({"alpha": 0.4, "depth": 3}, "exclude each other"),
        ({"depth": 0}, "depth must be greater than 0"),
        ({"depth": "0%"}, "depth must be a length, or a share of the scene's depth up to 100%"),
        ({"depth": "101%"}, "depth must be a length, or a share"),
        ({"depth": "nan%"}, "depth must be a length, or a share"),
        ({"depth": "12"}, "depth must be a length, or a share"),
        ({"depth": float("inf")}, "depth must be finite"),
        ({"smooth_points": 1}, "smooth_points must be True or False"),
        ({"k": 10**400}, "k must be a number"),
        ({"k": "5"}, "k must be a number"),
        ({"min_gap": -1}, "min_gap must be at least 0"),
        ({"min_gap": 1, "in_order": False}, "min_gap needs in_order"),
        ({"in_front": None}, "in_front must be True or False"),
        ({"seed": -1}, "seed must be at least 0"),
        ({"seed": 2**32}, "seed must be at most 4,294,967,295"),
        ({"k": 2**31}, "k must be at most 2,147,483,647"),
        ({"mode": "flat"}, 'mode must be "attenuation" or "bounded"'),
        ({"mode": "bounded"}, 'mode="bounded" needs a depth'),
        ({"mode": "bounded", "alpha": 0.5}, 'mode="bounded" needs a depth'),
        ({"depth": 3, "alpha_min": 0.5}, "alpha_min needs mode"),
        ({"depth": 3, "in_order": False}, "in_order=False needs mode"),
        ({"depth": 3, "in_front": False}, "in_front=False needs mode"),
        ({"attach": [1]}, "attach needs mode"),
        ({"weights": [1]}, "weights needs mode"),
        ({"depth": 3, "attach": [-1]}, "attach must be numbers of vertices"),
        ({"depth": 3, "attach": [1.5]}, "attach must be numbers of vertices"),
        ({"depth": 3, "attach": "12"}, "attach must be numbers of vertices"),
        ({"depth": 3, "attach": 5}, "attach must be numbers of vertices"),
        ({"depth": 3, "weights": [0.0]}, "weights must be finite and greater than 0"),
        ({"depth": 3, "weights": "no"}, "weights must be one number for each vertex"),
    ],
)
def test_wrong_parameters_are_named(values, words):
    with pytest.raises(ParameterError, match=words):
        ReliefParams(**values)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"front": "w"}, "front must be x, -x"),
        ({"front": "--x"}, "front must be x, -x"),
        ({"front": (0, 0, 0)}, "front must not be the zero vector"),
        ({"front": (0, 1)}, "front must be three numbers"),
        ({"front": np.array(1.0)}, "front must be three numbers"),
        ({"front": "y"}, "up must not be parallel to front"),
        ({"up": (0, float("nan"), 1)}, "up must be finite"),
        ({"viewpoint": (1, 2)}, "viewpoint must be three numbers"),
        ({"vanishing_point": (0, 0, 5)}, "behind the relief plane"),
    ],
)
def test_wrong_views_are_named(values, words):
    with pytest.raises(ParameterError, match=words):
        View(**values)


def test_directions_by_letter():
    view = View(front="-y", up="+z")
    assert view.front == (0.0, -1.0, 0.0)
    assert view.up == (0.0, 0.0, 1.0)


def test_numpy_values_are_taken_as_plain_numbers():
    params = ReliefParams(k=np.int64(7), beta=np.array([0.1, 0.3]))
    assert params.k == 7
    assert isinstance(params.k, int)
    assert params.beta == (0.1, 0.3)
    assert ReliefParams(beta=np.array(0.4)).beta == 0.4
    assert View(front=(0, 0, 1e-200)).front == View(front=(0, 0, 1e200)).front == (0.0, 0.0, 1.0)


def test_a_depth_chooses_the_mode():
    assert not ReliefParams().bounded
    assert ReliefParams(depth=3).bounded
    assert not ReliefParams(depth=3, mode="attenuation").bounded
    assert not ReliefParams.paper(depth=3).bounded
    assert ReliefParams(depth=3, attach=np.array([4, 2])).attach == (4, 2)


def test_a_depth_can_be_a_share():
    params = ReliefParams(depth=" 12.50 %", k=64)
    assert params.depth == "12.5%"
    assert params.bounded
    assert params.settled(80.0) == ReliefParams(depth=10.0, k=64)
    assert ReliefParams(depth=10.0).settled(80.0) == ReliefParams(depth=10.0)
    assert 0.0 < params.settled(0.0).depth < 1e-300  # a flat scene is left as it is
    assert ReliefParams(depth="100%").settled(3.0).depth == 3.0


def test_what_has_no_effect():
    assert ReliefParams(k=5, beta=0.1).unused == ()
    assert ReliefParams(depth=3).unused == ()
    assert ReliefParams(depth=3, beta=0.1, smooth_points=False, seed=4).unused == ("beta", "smooth_points")


def test_parameters_cannot_be_changed():
    with pytest.raises(dataclasses.FrozenInstanceError):
        ReliefParams().k = 3
