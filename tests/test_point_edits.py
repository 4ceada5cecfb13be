import pytest

from o3d_relief import ParameterError, PointEdit, ReliefParams


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"vertex": -1, "beta": 1}, "vertex must be a whole number, at least 0"),
        ({"vertex": 1.5, "beta": 1}, "vertex must be a whole number"),
        ({"vertex": "1", "beta": 1}, "vertex must be a whole number"),
        ({"vertex": 1}, "edit of vertex 1 changes nothing"),
        ({"vertex": 1, "action": "release"}, 'action must be "attach", "scale" or "discard"'),
        ({"vertex": 1, "beta": -0.5}, "beta must be at least 0"),
    ],
)
def test_wrong_edits_are_named(values, words):
    with pytest.raises(ParameterError, match=words):
        PointEdit(**values)


@pytest.mark.parametrize("values", [[3], 3, "no", [{"vertex": 3, "beta": 1}]])
def test_parameters_take_edits_only(values):
    with pytest.raises(ParameterError, match="point_edits must be a sequence of PointEdit"):
        ReliefParams(point_edits=values)


def test_edits_become_a_tuple():
    edit = PointEdit(vertex=4, action="attach")
    assert ReliefParams(point_edits=[edit]).point_edits == (edit,)
