from fractions import Fraction

import numpy as np
import pytest

from o3d_relief.array_checks import as_numbers, check_ends, check_size, check_views
from o3d_relief.errors import ParameterError
from o3d_relief.param_checks import (
    check_indices,
    check_kind,
    check_number,
    check_positive,
    check_triple,
    check_weights,
    check_whole,
    given,
)
from o3d_relief.params import ReliefParams, View
from o3d_relief.scan_params import ScanParams


@pytest.mark.parametrize("kind", [ReliefParams, View, ScanParams])
def test_what_is_not_given_is_at_its_defaults(kind):
    assert given("params", None, kind) == kind()
    own = kind()
    assert given("params", own, kind) is own


@pytest.mark.parametrize("value", [{"k": 3}, ReliefParams, ScanParams(), 0, False])
def test_another_kind_is_named(value):
    with pytest.raises(ParameterError, match=r"^params must be a ReliefParams\. Got .* instead\.$"):
        given("params", value, ReliefParams)


def test_long_values_are_told_by_their_class():
    with pytest.raises(ParameterError, match=r"one must be a int. Got 'word' instead."):
        check_kind("one", "word", int)
    for value in (np.zeros((3, 3)), "x" * 100):
        with pytest.raises(
            ParameterError, match=f"Got something of the class {type(value).__name__} instead"
        ):
            check_kind("one", value, int)


@pytest.mark.parametrize(
    "value", [5, 5.0, np.int64(5), np.uint8(5), np.float32(5.0), np.array(5), 2**62, Fraction(5)]
)
def test_whole_numbers_may_be_floats(value):
    assert check_whole("jobs", value) == value
    assert type(check_whole("jobs", value)) is int


@pytest.mark.parametrize(
    "value", [4.5, "5", True, np.True_, None, np.nan, np.inf, -np.inf, np.float64(np.inf), 1j, [5, 5], b"5"]
)
def test_what_is_no_whole_number_is_refused(value):
    with pytest.raises(ParameterError, match=r"^jobs must be a whole number, at least 1"):
        check_whole("jobs", value)


def test_limits_of_whole_numbers():
    assert [check_whole("size", value, 0, 9) for value in (0, 9)] == [0, 9]
    for value in (-1, 10, 1e300, 10**400):
        with pytest.raises(ParameterError, match="size must be a whole number between 0 and 9"):
            check_whole("size", value, 0, 9)
    with pytest.raises(ParameterError, match="k must be a whole number, at most 2,147,483,647"):
        check_whole("k", 2**31, 1, 2**31 - 1)


@pytest.mark.parametrize(
    "value",
    [["a"] * 10**5, np.full((50, 3), "a"), 10**5000, [10**5000]],
    ids=["words", "array", "int", "ints"],
)
@pytest.mark.parametrize(
    "check",
    [
        as_numbers,
        check_ends,
        check_number,
        check_positive,
        check_triple,
        check_views,
        check_weights,
        lambda name, value: check_size(value),
        lambda name, value: check_whole(name, value, 1, 9),
    ],
)
def test_no_sentence_is_longer_than_a_sentence(check, value):
    with pytest.raises(ParameterError, match=r"Got something of the class \w+ instead\.$") as caught:
        check("what", value)
    assert len(str(caught.value)) < 200


def test_the_wrong_one_of_many_is_named():
    with pytest.raises(ParameterError, match="Got -3 instead"):
        check_indices("attach", [*range(1000), -3])
