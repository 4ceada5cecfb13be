import dataclasses
from pathlib import Path

import numpy as np
import pytest

from o3d_relief import ParameterError, ReliefParams, View


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"k": 0}, "k must be a whole number, at least 1"),
        ({"k": 2.5}, "k must be a whole number"),
        ({"k": "many"}, "k must be a whole number"),
        ({"k": True}, "k must be a whole number"),
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
        ({"k": 10**400}, "k must be a whole number"),
        ({"k": "5"}, "k must be a whole number"),
        ({"min_gap": -1}, "min_gap must be at least 0"),
        ({"min_gap": 1e-3, "in_order": False}, "min_gap needs in_order"),
        ({"in_front": None}, "in_front must be True or False"),
        ({"seed": -1}, "seed must be a whole number, at least 0"),
        ({"seed": 2**32}, "seed must be a whole number, at most 4,294,967,295"),
        ({"k": 2**31}, "k must be a whole number, at most 2,147,483,647"),
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


@pytest.mark.parametrize("factor", [-3.0, 1e-5, 1e8])
def test_a_view_needs_an_up_that_is_not_its_front(factor):
    for front in np.random.default_rng(4).normal(size=(10, 3)):
        with pytest.raises(ParameterError, match="up must not be parallel to front"):
            View(front=front, up=factor * front)
        for axis in np.eye(3):
            View(front=front, up=factor * np.cross(front, axis))
            View(front=front, up=factor * (front + 1e-6 * axis))


@pytest.mark.parametrize(("front", "up"), [("x", "z"), ("y", "z"), ("z", "y"), ((0, 3, 1), "z")])
def test_another_up_is_proposed_that_will_do(front, up):
    with pytest.raises(ParameterError, match=f"give another up, for instance {up}"):
        View(front=front, up=front)
    View(front=front, up=up)


def test_directions_have_no_negative_zeros():
    for axis in "xyz":
        for sign in "+-":
            for view in (View(front=sign + axis, up=(1, 2, 3)), View(front=(1, 2, 3), up=sign + axis)):
                assert "-0.0" not in repr(view)
    assert "-0.0" not in repr(View(front=(-0.0, -0.0, 1), up=(1, -0.0, -0.0)))


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


def test_limits_belong_to_what_is_allowed():
    assert ReliefParams(k=1, seed=2**32 - 1, beta=0.0, min_gap=0.0).seed == 2**32 - 1
    assert ReliefParams(k=2**31 - 1).k == 2**31 - 1
    assert ReliefParams(attach_below=0.5, discard_above=0.5).attach_below == 0.5
    assert ReliefParams(attach_below=0.0, discard_above=1.0, blend=1.0).discard_above == 1.0
    assert ReliefParams(alpha=0.4, alpha_min=0.4).alpha_min == 0.4
    assert ReliefParams(alpha_min=1.0).alpha_min == 1.0
    assert ReliefParams(depth="0.05%", attach=[0], weights=[1e-3, 5.0]).weights == (1e-3, 5.0)


def test_defaults_are_those_of_the_readme():
    text = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")
    words = {None: "none", True: "on", False: "off", (): "none"}
    told = {}
    for line in text.splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if len(cells) == 4 and cells[0].startswith("`") and "View" not in cells[0]:
            told |= {name.strip("`"): cells[2] for name in cells[0].split(", ")}
    params = ReliefParams()
    values = {item.name: getattr(params, item.name) for item in dataclasses.fields(params)}
    assert told == {
        name: f"{value:g}" if type(value) in (int, float) else words[value] for name, value in values.items()
    }


def test_the_paper_has_none_of_the_guarantees():
    paper = ReliefParams.paper(k=7)
    guarantees = {"smooth_points": False, "in_front": False, "in_order": False}
    assert paper == ReliefParams(k=7, mode="attenuation", **guarantees)


def test_what_is_printed_is_short():
    assert "weights" not in repr(ReliefParams(depth=3, weights=np.ones(1000)))


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
    with pytest.raises(dataclasses.FrozenInstanceError):
        View().front = "x"
