import numpy as np
import pytest

from o3d_relief.errors import ParameterError
from o3d_relief.param_checks import check_kind, given
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
